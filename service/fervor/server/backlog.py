"""How much waits for the model, over all sessions: above a limit, sessions are read no further until less does."""

import asyncio
from collections import deque
from collections.abc import Callable

from fervor.engine.batcher import Batcher, Run
from fervor.server.turn import Turn


class Backlog:
    """The tickets that wait, and the sessions that wait for fewer of them."""

    def __init__(self, batcher: Batcher, turn: Turn, *, most: int) -> None:
        self._batcher = batcher
        self._turn = turn
        self._most = most
        self._waiting: deque[Callable[[], None]] = deque()
        batcher.watch(self._note)

    @property
    def full(self) -> bool:
        """Whether no session may bring more just now."""
        return self._batcher.depth + self._turn.depth >= self._most

    def wait(self, go_on: Callable[[], None]) -> None:
        """Have `go_on` called, once, when there is room; who waits comes on in order, each finding what is left."""
        self._waiting.append(go_on)
        if not self._batcher.depth:  # what waits for a turn may bring no tickets, and then no run follows
            asyncio.get_running_loop().call_soon(self._note)

    def _note(self, _: Run | None = None) -> None:
        while self._waiting and not self.full:
            self._waiting.popleft()()
