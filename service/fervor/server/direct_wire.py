"""The direct way to a client: a connection after its handshake, and nothing else of it.

It takes the place of the protocol object that made the handshake, so that no request, queue or task of it lives as
long as the session. A message that comes whole, as nearly all do, is handed to the conversation in the turn of the
event loop in which its bytes came, and an answer is written as it is given. All else goes by a `Parser`, which is
there only while there is need.

Frames that are no messages (pings, pongs, pieces of a message) have a pace, too. Pings of a client that reads nothing
are not answered, so that pongs can't pile up. A connection whose conversation is over is cut if its client does not
take what is left.
"""

import asyncio
import logging
import secrets
from typing import Any

from uvicorn import Config
from websockets.frames import Frame, Opcode

from fervor.errors import CloseCode, RateExceeded
from fervor.server.cutter import FIN, as_frame, whole
from fervor.server.pace import Pace
from fervor.server.parser import Parser
from fervor.server.service import Service
from fervor.server.wire import Listener

log = logging.getLogger(__name__)

LEFT_BEHIND_S = 5.0
"""Seconds that a client has to take what is left, once the conversation is over."""

LINGER_S = 1.0
"""Seconds that a client has to read why it is closed before it has said all: to cut it at once could lose that."""


class DirectWire(asyncio.Protocol):
    """See `Wire`."""

    __slots__ = (
        "_config",
        "_connections",
        "_cut",
        "_listener",
        "_loop",
        "_most_bytes",
        "_pace",
        "_parser",
        "_pinged",
        "_service",
        "_silent_since",
        "_stuck",
        "transport",
    )

    def __init__(self, config: Config, connections: set[Any], service: Service) -> None:
        """Wait for a connection.

        Args:
            config: uvicorn's, for the largest message, and when to look whether a client is still there.
            connections: uvicorn's, to be told of its end.
            service: that the connection is for.
        """
        self._config = config
        self._connections = connections
        self._service = service
        self._most_bytes = config.ws_max_size
        self._loop = asyncio.get_running_loop()
        self.transport: asyncio.Transport | None = None  # while there is a connection
        self._listener: Listener | None = None  # while there is a conversation
        self._stuck = False
        self._parser: Parser | None = None
        self._pace: Pace | None = None  # of frames that are no messages; once there was one
        self._pinged: bytes | None = None  # what a ping under way holds
        self._silent_since = self._loop.time()  # the newest ping, or its answer; seconds
        self._cut: asyncio.TimerHandle | None = None

    def take_over(self, transport: asyncio.Transport) -> None:
        """This is the connection, its handshake done; nothing is read from it before `carry`."""
        self.transport = transport
        self._connections.add(self)
        transport.set_protocol(self)

    # The wire.

    @property
    def stuck(self) -> bool:
        """See `Wire`."""
        return self._stuck

    async def carry(self, listener: Listener) -> None:
        """See `Wire`; returns at once."""
        if self.transport is None:
            listener.lost()
            return
        self._listener = listener
        self.resume()

    def write(self, message: str | bytes) -> bool:
        """See `Wire`."""
        if self._stuck or self._listener is None or self.transport is None:
            return False
        self.transport.write(as_frame(message))
        return True

    def close(self, code: CloseCode, reason: str) -> bool:
        """See `Wire`."""
        if self._stuck or self.transport is None:
            return False
        parser = self._complete()
        parser.close(code, reason)
        self.transport.write(parser.answer())
        return True

    def pause(self) -> None:
        """See `Wire`."""
        if self.transport is not None and not self.transport.is_closing():
            self.transport.pause_reading()

    def resume(self) -> None:
        """See `Wire`."""
        if self.transport is not None and not self.transport.is_closing():
            self.transport.resume_reading()

    def leave(self) -> None:
        """See `Wire`."""
        self._listener = None
        if self.transport is None or self._cut is not None:
            return
        if self._complete().open:  # it took too little for a close to be sent
            self.transport.close()
        self.resume()
        self._cut = self._loop.call_later(LEFT_BEHIND_S, self.transport.abort)

    def look(self, now: float) -> None:
        """See `Wire`: ping a client now and then, and close where it does not answer."""
        every, patience = self._config.ws_ping_interval, self._config.ws_ping_timeout
        if self.transport is None or every is None or not (self._parser is None or self._parser.open):
            return
        if self._pinged is None and now - self._silent_since >= every:
            self._pinged, self._silent_since = secrets.token_bytes(4), now
            self.transport.write(bytes((FIN | Opcode.PING, len(self._pinged))) + self._pinged)
        elif self._pinged is not None and patience is not None and now - self._silent_since >= patience:
            self._complete().fail(CloseCode.INTERNAL, "keepalive ping timeout")
            self._end()

    # The connection.

    def data_received(self, data: bytes) -> None:
        """Bytes of frames."""
        if self._parser is None and self._listener is not None:
            message = whole(data, self._most_bytes)
            if message is not None:
                self._listener.came(message)
                return
        self._parse(data)

    def pause_writing(self) -> None:
        """The client takes nothing just now."""
        self._stuck = True

    def resume_writing(self) -> None:
        """The client takes something again."""
        self._stuck = False
        if self._listener is not None:
            self._listener.writable()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  # see asyncio
        """The connection is gone."""
        if self._cut is not None:
            self._cut.cancel()
        self._connections.discard(self)
        assert self.transport is not None
        self._service.connections.leave(self.transport)
        self.transport = None
        self._lose()

    def shutdown(self) -> None:
        """The service stops, and has no more time; uvicorn calls this."""
        if self.transport is not None:
            parser = self._complete()
            parser.close(CloseCode.RESTART)
            self.transport.write(parser.answer())
            self.transport.close()
            self._lose()

    # What is no whole message.

    def _complete(self) -> Parser:
        if self._parser is None:
            self._parser = Parser(most_bytes=self._most_bytes)
        return self._parser

    def _parse(self, data: bytes) -> None:
        parser = self._complete()
        if parser.ends:
            return
        try:
            for part in parser.feed(data):
                if isinstance(part, Frame):
                    self._note(part)
                elif self._listener is not None:
                    self._listener.came(part)
        except RateExceeded as error:
            parser.answer()  # who floods gets no pongs
            parser.fail(CloseCode.RATE, error.code)
        if parser.ends:
            self._end()
            return
        answer = parser.answer()
        if answer and not self._stuck and self.transport is not None:
            self.transport.write(answer)
        if parser.at_rest:
            self._parser = None

    def _note(self, frame: Frame) -> None:
        """Count a frame that is no message.

        Raises:
            RateExceeded: there are too many.
        """
        if frame.opcode is Opcode.CLOSE:
            return
        now = self._loop.time()
        if self._pace is None:
            settings = self._service.settings
            self._pace = Pace(settings.max_frames_per_second, settings.max_frames_per_message)
        self._pace.take(1, now)
        if frame.opcode is Opcode.PONG and bytes(frame.data) == self._pinged:
            self._pinged, self._silent_since = None, now

    def _end(self) -> None:
        """Send the last word; let the connection go once nothing can be lost by that."""
        parser, transport = self._complete(), self.transport
        if parser.complaint is not None:
            log.warning(parser.complaint)
        if transport is not None and not transport.is_closing():
            transport.write(parser.answer())
            if parser.agreed:
                transport.close()
            else:
                self._linger(transport)
        self._lose()

    def _linger(self, transport: asyncio.Transport) -> None:
        if transport.can_write_eof():
            transport.write_eof()
        self.resume()
        if self._cut is not None:
            self._cut.cancel()
        self._cut = self._loop.call_later(LINGER_S, transport.abort)

    def _lose(self) -> None:
        listener, self._listener = self._listener, None
        if listener is not None:
            listener.lost()
