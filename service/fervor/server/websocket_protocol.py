"""uvicorn's WebSocket protocol, with what it leaves out.

With transport `direct` it offers a shortcut past ASGI (`fervor.server.wire`): messages that come whole are handed to
the conversation in the turn in which they came, and answers are written as they are given.

Frames that are no messages (pings, pongs, pieces of a message) have a pace, too. Pings of a client that reads nothing
are not answered, so that pongs can't pile up. A connection whose conversation is over is cut if its client does not
take what is left. Nothing of a request's headers is logged.
"""

import struct
from asyncio import TimerHandle
from http import HTTPStatus
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.datastructures import Headers
from websockets.frames import Frame, Opcode
from websockets.http11 import Request, Response
from websockets.protocol import CONNECTING, OPEN

from fervor.errors import RateExceeded
from fervor.server.cutter import FIN, SHORT, Cutter, Message
from fervor.server.pace import Pace
from fervor.server.problems import CODES, problem
from fervor.server.service import Service
from fervor.server.wire import EXTENSION, Take

PIECE = 4096
"""Bytes that are read in one go; so many small frames at most come between two looks at the pace."""

LEFT_BEHIND_S = 5.0
"""Seconds that a client has to take what is left, once the conversation is over."""


_MEDIUM, _LONG = struct.Struct("!BBH"), struct.Struct("!BBQ")


class GuardedWebSocket(WebSocketsSansIOProtocol):
    """One WebSocket connection."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        assert isinstance(service, Service)
        self._neighbours = service.connections
        rate = service.settings.max_frames_per_second
        self._pace = Pace(rate, service.settings.max_frames_per_message)
        self._direct = service.settings.transport == "direct"
        self._cutter: Cutter | None = None
        self.take: Take | None = None
        """See `Shortcut`."""
        self._cut: TimerHandle | None = None
        self.conn.debug = False  # it would log headers, tokens among them
        self.conn.reject = _reject  # type: ignore[method-assign]  # its own refusals are plain text

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is gone."""
        if self._cut is not None:
            self._cut.cancel()
        self._neighbours.leave(self.transport)
        self.take = None
        super().connection_lost(exc)

    def handle_connect(self, event: Request) -> None:
        """A handshake: the application decides on it."""
        super().handle_connect(event)
        if self._direct and not self.handshake_complete:
            self._cutter = Cutter(most_bytes=self.config.ws_max_size)
            extensions: dict[str, Any] = self.scope["extensions"]
            extensions[EXTENSION] = self  # the task that reads it runs later

    def data_received(self, data: bytes) -> None:
        """Bytes of frames."""
        if self._cutter is None:
            self._parse(data)
            return
        if self._can_take and (message := self._cutter.whole(data)) is not None:
            if self.take is None or not self.take(message):
                self._hand_over(Message(message, is_text=False))
            return
        for part in self._cutter.cut(data):
            if isinstance(part, bytes):
                self._parse(part)
            elif self.conn.state in (CONNECTING, OPEN) and not self.transport.is_closing():
                self._hand_over(part)

    @property
    def _can_take(self) -> bool:
        """Whether a message would go to the conversation, and none waits before it."""
        if self.take is None or self.close_sent or self.conn.state is not OPEN:
            return False
        return self.queue.empty() and not self.transport.is_closing()

    def _parse(self, data: bytes) -> None:
        """Let the complete parser have these bytes."""
        for start in range(0, len(data), PIECE):
            if self.transport.is_closing():
                return
            super().data_received(data[start : start + PIECE])

    def _hand_over(self, message: Message) -> None:
        self.curr_msg_data_type = "text" if message.is_text else "bytes"
        self.frames = [message.payload]
        self.send_receive_event_to_app()

    def send_receive_event_to_app(self) -> None:
        """A message is there."""
        if self.take is None or self.close_sent or not self.queue.empty():
            super().send_receive_event_to_app()
            return
        data = b"".join(self.frames)
        try:
            message = data.decode() if self.curr_msg_data_type == "text" else data
        except UnicodeDecodeError:
            super().send_receive_event_to_app()  # which says so
            return
        if self.take(message):
            self.frames = []
        else:
            super().send_receive_event_to_app()

    def write(self, message: str | bytes) -> bool:
        """See `Shortcut`."""
        if self.conn.state is not OPEN or not self.writable.is_set() or self.transport.is_closing():
            return False
        self.transport.write(_as_frame(message))
        return True

    def handle_ping(self) -> None:
        """Answer, if the client reads; RFC 6455 asks for an answer to the newest ping only."""
        self._count()
        if self.writable.is_set():
            super().handle_ping()
        else:
            self.conn.data_to_send()

    def handle_pong(self, event: Frame) -> None:
        """Take note."""
        self._count()
        super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        """Take the next piece of a message."""
        self._count()
        super().handle_cont(event)

    async def run_asgi(self) -> None:
        """Hold the conversation; see that the connection ends with it."""
        try:
            await super().run_asgi()
        finally:
            self._cut = self.loop.call_later(LEFT_BEHIND_S, self.transport.abort)

    def _count(self) -> None:
        try:
            self._pace.take(1, self.loop.time())
        except RateExceeded as error:
            if self.close_sent or self.transport.is_closing():
                return
            self.conn.data_to_send()
            self.conn.fail(error.close_code, error.code)
            self.handle_parser_exception()


def _as_frame(message: str | bytes) -> bytes:
    """A message as a frame of a server: in one, without a mask."""
    opcode, payload = (Opcode.TEXT, message.encode()) if isinstance(message, str) else (Opcode.BINARY, message)
    size = len(payload)
    if size < SHORT:
        return bytes((FIN | opcode, size)) + payload
    if size < 65536:
        return _MEDIUM.pack(FIN | opcode, SHORT, size) + payload
    return _LONG.pack(FIN | opcode, SHORT + 1, size) + payload


def _reject(status: int, text: str) -> Response:
    """The refusal of a handshake that is none, as a problem."""
    refusal = problem(status, text.strip().rstrip("."), CODES.get(status, CODES[400]))
    headers = [(name.decode("latin-1"), value.decode("latin-1")) for name, value in refusal.raw_headers]
    phrase = HTTPStatus(status).phrase
    return Response(status, phrase, Headers([*headers, ("Connection", "close")]), bytes(refusal.body))
