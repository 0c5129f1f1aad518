"""How much waits for the model, over all sessions: above a limit, sessions are read no further until less does."""

import asyncio

from fervor.engine.batcher import Batcher, Run
from fervor.server.turn import Turn


class Backlog:
    """The tickets that wait, and the sessions that wait for fewer of them."""

    def __init__(self, batcher: Batcher, turn: Turn, *, most: int) -> None:
        self._batcher = batcher
        self._turn = turn
        self._most = most
        self._room = asyncio.Event()
        batcher.watch(self._note)

    @property
    def full(self) -> bool:
        """Whether no session may bring more just now."""
        return self._batcher.depth + self._turn.depth >= self._most

    async def wait(self) -> None:
        """Wait until there is room; who waits comes on one after the other, each finding what the one before left."""
        while self.full:
            self._room.clear()
            await self._room.wait()

    def _note(self, _: Run) -> None:
        if not self.full:
            self._room.set()
