"""uvicorn's WebSocket protocol, with what it leaves out.

Frames that are no messages (pings, pongs, pieces of a message) have a pace, too. Pings of a client that reads nothing
are not answered, so that pongs can't pile up. A connection whose conversation is over is cut if its client does not
take what is left. Nothing of a request's headers is logged.
"""

from asyncio import TimerHandle
from http import HTTPStatus
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.datastructures import Headers
from websockets.frames import Frame
from websockets.http11 import Response

from fervor.errors import RateExceeded
from fervor.server.pace import Pace
from fervor.server.problems import CODES, problem
from fervor.server.service import Service

PIECE = 4096
"""Bytes that are read in one go; so many small frames at most come between two looks at the pace."""

LEFT_BEHIND_S = 5.0
"""Seconds that a client has to take what is left, once the conversation is over."""


class GuardedWebSocket(WebSocketsSansIOProtocol):
    """One WebSocket connection."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        assert isinstance(service, Service)
        self._neighbours = service.connections
        rate = service.settings.max_frames_per_second
        self._pace = Pace(rate, service.settings.max_frames_per_message)
        self._cut: TimerHandle | None = None
        self.conn.debug = False  # it would log headers, tokens among them
        self.conn.reject = _reject  # type: ignore[method-assign]  # its own refusals are plain text

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is gone."""
        if self._cut is not None:
            self._cut.cancel()
        self._neighbours.leave(self.transport)
        super().connection_lost(exc)

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


def _reject(status: int, text: str) -> Response:
    """The refusal of a handshake that is none, as a problem."""
    refusal = problem(status, text.strip().rstrip("."), CODES.get(status, CODES[400]))
    headers = [(name.decode("latin-1"), value.decode("latin-1")) for name, value in refusal.raw_headers]
    phrase = HTTPStatus(status).phrase
    return Response(status, phrase, Headers([*headers, ("Connection", "close")]), bytes(refusal.body))
