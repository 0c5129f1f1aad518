"""uvicorn's WebSocket protocol, with what it leaves out.

With transport `direct` it makes the handshake only: what accepts it may take the connection over (`DirectWire`), and
this object, with all that ASGI needs, is gone.

Otherwise: frames that are no messages (pings, pongs, pieces of a message) have a pace, too. Pings of a client that
reads nothing are not answered, so that pongs can't pile up. A connection whose conversation is over is cut if its
client does not take what is left. Nothing of a request's headers is logged.
"""

import asyncio
from asyncio import TimerHandle
from http import HTTPStatus
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.datastructures import Headers
from websockets.frames import Frame
from websockets.http11 import Request, Response

from fervor.errors import RateExceeded
from fervor.server.direct_wire import LEFT_BEHIND_S, DirectWire
from fervor.server.pace import Pace
from fervor.server.parser import PIECE
from fervor.server.problems import CODES, problem
from fervor.server.service import Service
from fervor.server.wire import EXTENSION


class GuardedWebSocket(WebSocketsSansIOProtocol):
    """One WebSocket connection."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        assert isinstance(service, Service)
        self._service = service
        rate = service.settings.max_frames_per_second
        self._pace = Pace(rate, service.settings.max_frames_per_message)
        self._heir: DirectWire | None = None
        self._cut: TimerHandle | None = None
        self.conn.debug = False  # it would log headers, tokens among them
        self.conn.reject = _reject  # type: ignore[method-assign]  # its own refusals are plain text

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is gone."""
        if self._cut is not None:
            self._cut.cancel()
        self._service.connections.leave(self.transport)
        super().connection_lost(exc)

    # The handshake.

    def handle_connect(self, event: Request) -> None:
        """A handshake: the application decides on it; until then nothing more is read."""
        super().handle_connect(event)
        if not self.handshake_complete and self._service.settings.transport == "direct":
            self.transport.pause_reading()
            extensions: dict[str, Any] = self.scope["extensions"]
            extensions[EXTENSION] = self  # the task that reads it runs later

    def offer(self) -> DirectWire:
        """See `Shortcut`."""
        self._heir = DirectWire(self.config, self.connections, self._service)
        return self._heir

    async def send(self, message: Any) -> None:
        """Say what the application says; with its accept, go on by one way or the other."""
        await super().send(message)
        if message["type"] == "websocket.accept" and not self.transport.is_closing():
            if self._heir is not None:
                self._hand_over(self._heir)
            elif EXTENSION in self.scope["extensions"]:
                self.transport.resume_reading()

    def _hand_over(self, heir: DirectWire) -> None:
        """The connection goes to another protocol; what is left here is not to touch it, nor to be held by it."""
        self.stop_keepalive()
        self.connections.discard(self)
        heir.take_over(self.transport)
        self.transport = _HandedOver()
        self.disconnected = True
        del self.scope["extensions"][EXTENSION]

    # The way of ASGI.

    def data_received(self, data: bytes) -> None:
        """Bytes of frames."""
        for start in range(0, len(data), PIECE):
            if self.transport.is_closing():
                return
            super().data_received(data[start : start + PIECE])

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
            if not isinstance(self.transport, _HandedOver):
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


class _HandedOver(asyncio.Transport):
    """In place of a transport that another protocol has now: nothing to write to, nothing to close."""

    def is_closing(self) -> bool:
        return True

    def close(self) -> None:
        pass


def _reject(status: int, text: str) -> Response:
    """The refusal of a handshake that is none, as a problem."""
    refusal = problem(status, text.strip().rstrip("."), CODES.get(status, CODES[400]))
    headers = [(name.decode("latin-1"), value.decode("latin-1")) for name, value in refusal.raw_headers]
    phrase = HTTPStatus(status).phrase
    return Response(status, phrase, Headers([*headers, ("Connection", "close")]), bytes(refusal.body))
