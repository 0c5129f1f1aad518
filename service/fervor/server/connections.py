"""The TCP connections of a service, whatever is spoken on them: how many there are, and whether one more may stay."""

from asyncio import BaseTransport
from collections.abc import Callable

MARGIN = 256
"""Connections above the limit that are told why; beyond, they are cut without a word."""


class Connections:
    """All connections that are open."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._open: set[BaseTransport] = set()
        self._watchers: list[Callable[[], None]] = []
        self.entered = 0
        """How many ever came."""
        self.refused = 0

    def watch(self, watcher: Callable[[], None]) -> None:
        """Be told when one came or went."""
        self._watchers.append(watcher)

    @property
    def open(self) -> int:
        """How many there are."""
        return len(self._open)

    @property
    def hopeless(self) -> bool:
        """Whether there are too many even to tell them so."""
        return len(self._open) > self._most + MARGIN

    def enter(self, transport: BaseTransport) -> bool:
        """A connection came; whether there is room for it. `leave` follows either way."""
        self._open.add(transport)
        self.entered += 1
        self._tell()
        if len(self._open) <= self._most:
            return True
        self.refused += 1
        return False

    def leave(self, transport: BaseTransport) -> None:
        """A connection is gone."""
        self._open.discard(transport)
        self._tell()

    def _tell(self) -> None:
        for watcher in self._watchers:
            watcher()
