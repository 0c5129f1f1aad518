"""uvicorn's HTTP protocol, with what it leaves out: a client that takes its time, or has no end, is shown the door.

Headers have a time and a size, bodies a time; connections have a number. Whoever is shown the door gets a problem
first, as from anywhere else in the service.
"""

from asyncio import BaseTransport, TimerHandle, Transport
from enum import Enum, auto
from http import HTTPStatus
from typing import Any, cast

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from fervor.errors import Overloaded
from fervor.server.problems import CODES, problem
from fervor.server.service import Service

LINGER_S = 1.0
"""Seconds a refused client has to read why, before the connection is cut."""

COME_BACK_S = 1.0
"""What a client that found too many others is told to wait, seconds."""


class _Stage(Enum):
    HEADERS = auto()
    BODY = auto()
    COMPLETE = auto()
    REFUSED = auto()


class GuardedHttp(HttpToolsProtocol):
    """One HTTP connection."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        service = self.config.app.state.service  # type: ignore[union-attr]  # create_app put it there
        assert isinstance(service, Service)
        self._settings = service.settings
        self._neighbours = service.connections
        self._stage = _Stage.HEADERS
        self._head = 0  # bytes of the request's headers so far
        self._deadline: TimerHandle | None = None

    def connection_made(self, transport: BaseTransport) -> None:
        """Begin to wait for a request, if there is room for this connection."""
        super().connection_made(cast("Transport", transport))
        if self._neighbours.enter(transport):
            self._allow(self._settings.header_timeout_s)
        elif self._neighbours.hopeless:
            self.transport.abort()
        else:
            self._refuse(503, "this service has as many connections as it takes", retry_after=COME_BACK_S)

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is gone."""
        self._forget_deadline()
        self._neighbours.leave(self.transport)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes of requests, of which headers may be only so many."""
        room = len(data)
        if self._stage is _Stage.HEADERS:
            room = self._settings.max_header_bytes - self._head
            self._head += min(len(data), room)
        self._feed(data[:room])
        if len(data) > room:
            self._feed_rest(data[room:])

    def _feed(self, data: bytes) -> None:
        if self._stage is not _Stage.REFUSED and not self._is_gone:
            super().data_received(data)

    def _feed_rest(self, rest: bytes) -> None:
        """What came after as many bytes as headers may have: no headers, then."""
        if self._stage is _Stage.HEADERS and not self._is_gone:
            most = self._settings.max_header_bytes
            self._refuse(431, f"the headers are larger than {most} bytes, the most that this service takes")
        self._feed(rest)

    def handle_websocket_upgrade(self) -> None:
        """From here on it is a WebSocket, which has timeouts of its own; nothing of this object is left behind."""
        self._forget_deadline()
        super().handle_websocket_upgrade()
        self.parser = None  # type: ignore[assignment]  # it calls us: a circle that only the collector could break

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002  # a sentence for logs
        """What came is not HTTP."""
        self._refuse(400, "what came is no HTTP request")

    # Callbacks of the parser.

    def on_message_begin(self) -> None:
        """The first byte of a request."""
        super().on_message_begin()
        self._stage, self._head = _Stage.HEADERS, 0
        if self._deadline is None:  # the first request's time began with the connection
            self._allow(self._settings.header_timeout_s)

    def on_headers_complete(self) -> None:
        """The headers are there; the body is next."""
        self._stage = _Stage.BODY
        self._allow(self._settings.body_timeout_s)
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """The request is there."""
        self._stage = _Stage.COMPLETE
        self._forget_deadline()
        super().on_message_complete()

    # The door.

    @property
    def _is_gone(self) -> bool:
        return self.transport.is_closing() or self.transport.get_protocol() is not self

    def _allow(self, seconds: float) -> None:
        self._forget_deadline()
        self._deadline = self.loop.call_later(seconds, self._time_is_up)

    def _forget_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _time_is_up(self) -> None:
        self._deadline = None
        if self._stage is _Stage.BODY:
            self._refuse(408, f"the body did not come within {self._settings.body_timeout_s:g} s")
        elif self._stage is _Stage.HEADERS:
            seconds = self._settings.header_timeout_s
            self._refuse(408, f"no request came to the end of its headers within {seconds:g} s")

    def _refuse(self, status: int, detail: str, *, retry_after: float | None = None) -> None:
        """Say why, unless an answer is under way; then take nothing more, and cut the connection."""
        self._forget_deadline()
        self._unset_keepalive_if_required()
        cycle: RequestResponseCycle | None = self.cycle
        reading_body = self._stage is _Stage.BODY
        self._stage = _Stage.REFUSED
        answered = cycle is not None and cycle.response_started and (reading_body or not cycle.response_complete)
        if cycle is not None and not cycle.response_complete:
            cycle.disconnected = True  # what the application says from here on goes nowhere
            cycle.message_event.set()
        if self.transport.is_closing():
            return
        if not answered:
            self.transport.write(_as_bytes(status, detail, retry_after))
        self.transport.resume_reading()
        if self.transport.can_write_eof():
            self.transport.write_eof()  # closing at once could lose the answer, with bytes of the client still unread
        self._deadline = self.loop.call_later(LINGER_S, self.transport.abort)


def _as_bytes(status: int, detail: str, retry_after: float | None) -> bytes:
    """A problem as a whole response, after which the connection closes."""
    response = problem(status, detail, CODES.get(status, Overloaded.code), retry_after=retry_after)
    head = b"".join(b"%s: %s\r\n" % header for header in response.raw_headers)
    phrase = HTTPStatus(status).phrase.encode()
    return b"HTTP/1.1 %d %s\r\n%sconnection: close\r\n\r\n%s" % (status, phrase, head, bytes(response.body))
