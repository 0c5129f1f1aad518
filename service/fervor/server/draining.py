"""Leaving in good order: no new sessions, a last checkpoint for every body, then 1012 to every client.

Readiness is false from the first moment, so that a load balancer sends nobody new while the listener is still open.
"""

import asyncio
from functools import reduce
from typing import Protocol

from fervor.protocol.messages import Totals
from fervor.server.traffic import Traffic
from fervor.session.session import Session


class Leaving(Protocol):
    """A conversation that can be told to end, and asked what it came to."""

    __slots__ = ()

    @property
    def totals(self) -> Totals:
        """So far."""

    @property
    def traffic(self) -> Traffic:
        """What went over the wire so far."""

    @property
    def session(self) -> Session:
        """What it is about, for who watches."""

    def look(self, now: float) -> None:
        """See whether a timeout is over; `now` is the event loop's time, seconds."""

    def go_away(self, seconds: float) -> None:
        """Say so, send the last checkpoints, and close once they are out."""

    def send_away(self, retry_after: float) -> None:
        """Close with 1013: there is more load than the service can bear; `retry_after` is in seconds."""


class Drain:
    """The conversations of a service, and whether it is on its way out."""

    def __init__(self) -> None:
        self.started = False
        self.begun = 0
        self.talking: dict[Leaving, None] = {}  # oldest first
        self._ended = Totals()
        self._carried = Traffic()
        self._empty = asyncio.Event()

    def enter(self, conversation: Leaving) -> None:
        """A conversation began."""
        self.begun += 1
        self.talking[conversation] = None

    def leave(self, conversation: Leaving) -> None:
        """A conversation is over."""
        self.talking.pop(conversation, None)
        self._ended = add(self._ended, conversation.totals)
        self._carried = self._carried + conversation.traffic
        if not self.talking:
            self._empty.set()

    def all_totals(self) -> Totals:
        """What all conversations came to."""
        return reduce(add, (conversation.totals for conversation in self.talking), self._ended)

    def all_traffic(self) -> Traffic:
        """What went over all wires."""
        return sum((conversation.traffic for conversation in self.talking), self._carried)

    async def run(self, seconds: float) -> bool:
        """Send everybody away; whether all were gone within `seconds`."""
        self.started = True
        if not self.talking:
            return True
        self._empty.clear()
        for conversation in list(self.talking):
            conversation.go_away(seconds)
        try:
            async with asyncio.timeout(seconds):
                await self._empty.wait()
        except TimeoutError:
            return False
        return True


def add(one: Totals, other: Totals) -> Totals:
    """The sum of two."""
    return Totals(**{name: getattr(one, name) + getattr(other, name) for name in Totals.model_fields})
