"""Leaving in good order: no new sessions, a last checkpoint for every body, then 1012 to every client.

Readiness is false from the first moment, so that a load balancer sends nobody new while the listener is still open.
"""

import asyncio
from typing import Protocol


class Leaving(Protocol):
    """A conversation that can be told to end."""

    def go_away(self, seconds: float) -> None:
        """Say so, send the last checkpoints, and close once they are out."""


class Drain:
    """The conversations of a service, and whether it is on its way out."""

    def __init__(self) -> None:
        self.started = False
        self._talking: set[Leaving] = set()
        self._empty = asyncio.Event()

    def enter(self, conversation: Leaving) -> None:
        """A conversation began."""
        self._talking.add(conversation)

    def leave(self, conversation: Leaving) -> None:
        """A conversation is over."""
        self._talking.discard(conversation)
        if not self._talking:
            self._empty.set()

    async def run(self, seconds: float) -> bool:
        """Send everybody away; whether all were gone within `seconds`."""
        self.started = True
        if not self._talking:
            return True
        self._empty.clear()
        for conversation in list(self._talking):
            conversation.go_away(seconds)
        try:
            async with asyncio.timeout(seconds):
                await self._empty.wait()
        except TimeoutError:
            return False
        return True
