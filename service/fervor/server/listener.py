"""The listening socket that workers share, as one of them sees it: it takes what comes, or leaves it to the others.

Why not uvloop's own: that takes all it can get. This one looks at the `Shares` before each connection.
"""

import asyncio
import logging
import socket
from collections.abc import Callable

from fervor.server.connections import Connections
from fervor.server.shares import Shares

log = logging.getLogger(__name__)

HOLD_S = 0.001
"""Pause of a worker that is ahead, before it looks again."""

BEAT_S = 0.25
"""How often a worker shows that it lives, however little happens."""

RETRY_S = 1.0
"""Pause where the system lets the process have no more connections."""


class Listener:
    """A server in asyncio's sense: `close` and `wait_closed`.

    Args:
        bound: the socket; it listens from here on.
        backlog: connections that may wait to be taken.
        make_protocol: makes the protocol of each connection.
        connections: those that are open here, each entered by its protocol.
        is_full: whether a session that came would be refused.
        shares: what the others have.
        place: of this worker.
    """

    def __init__(
        self,
        bound: socket.socket,
        backlog: int,
        make_protocol: Callable[[], asyncio.Protocol],
        *,
        connections: Connections,
        is_full: Callable[[], bool],
        shares: Shares,
        place: int,
    ) -> None:
        self._bound = bound
        self._make_protocol = make_protocol
        self._connections = connections
        self._is_full = is_full
        self._shares = shares
        self._place = place
        self._loop = asyncio.get_running_loop()
        self._taken = 0
        self._arriving: set[asyncio.Task[None]] = set()
        self._closed = False
        bound.setblocking(False)  # noqa: FBT003  # the standard library's
        bound.listen(backlog)
        self._timers = [self._loop.call_soon(self._beat), self._loop.call_soon(self._listen)]
        self._connections.watch(self._tell)

    def close(self) -> None:
        """Take no more; the others do."""
        if self._closed:
            return
        self._closed = True
        for timer in self._timers:
            timer.cancel()
        self._loop.remove_reader(self._bound)
        self._shares.withdraw(self._place)

    async def wait_closed(self) -> None:
        """Until those on their way have arrived."""
        await asyncio.gather(*self._arriving, return_exceptions=True)

    @property
    def _open(self) -> int:
        """Connections, with those that were taken but are not yet entered."""
        return self._connections.open + self._taken - self._connections.entered

    def _listen(self) -> None:
        self._loop.add_reader(self._bound, self._take)

    def _pause(self, seconds: float) -> None:
        self._loop.remove_reader(self._bound)
        self._timers[1] = self._loop.call_later(seconds, self._listen)

    def _beat(self) -> None:
        self._timers[0] = self._loop.call_later(BEAT_S, self._beat)
        self._tell()

    def _tell(self) -> None:
        """Show the others how things stand here."""
        if self._closed:
            return
        if self._is_full():
            self._shares.withdraw(self._place)
        else:
            self._shares.tell(self._place, self._open)

    @property
    def _is_due(self) -> bool:
        """Whether the next connection is for this worker; of those that are full, each takes what comes, to say so."""
        if self._is_full():
            return self._shares.fewest_of_others(self._place) is None
        return not self._shares.is_ahead(self._place, self._open)

    def _take(self) -> None:
        """Connections wait: take them until the others are behind."""
        self._tell()
        while self._is_due:
            try:
                taken, _ = self._bound.accept()
            except (BlockingIOError, ConnectionAbortedError):
                return
            except OSError as error:
                log.warning("no connection could be taken: %s", error.strerror)
                self._shares.withdraw(self._place)
                self._pause(RETRY_S)
                return
            self._welcome(taken)
        self._pause(HOLD_S)

    def _welcome(self, taken: socket.socket) -> None:
        self._taken += 1
        coming = self._loop.create_task(self._bring_in(taken))
        self._arriving.add(coming)
        coming.add_done_callback(self._arriving.discard)
        self._tell()

    async def _bring_in(self, taken: socket.socket) -> None:
        """Give a connection its protocol, unless its client is gone again."""
        taken.setblocking(False)  # noqa: FBT003  # the standard library's
        try:
            await self._loop.connect_accepted_socket(self._make_protocol, taken)
        except OSError:
            taken.close()
            self._taken -= 1
