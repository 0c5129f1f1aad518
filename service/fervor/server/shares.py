"""How many connections each worker has, in memory that all share, and so whose turn it is to take the next one.

Why: all workers wait on one socket, and whoever is woken first takes what comes. A worker that is busy would get few,
an idle one many; but what a session costs comes later, with its frames. So who is ahead leaves the next one to others.

Rules. As on the board, only the worker at a place writes there, and there is no lock: each number is one aligned word.
Who has been silent for `PATIENCE_S` is not waited for, and neither is who can't let anybody in: no connection is left
waiting for a worker that is stuck, full or gone.
"""

import mmap
from time import monotonic

PATIENCE_S = 1.0
"""Silence after which the others go on without a worker."""

EVEN = 64
"""A worker may be ahead of another by one connection for so many that the other has, so that many come in quickly."""

_WORD = 8


class Shares:
    """The connections of a service's workers, by place."""

    def __init__(self, places: int) -> None:
        memory = memoryview(mmap.mmap(-1, 2 * places * _WORD))
        self._connections = memory[: places * _WORD].cast("q")  # [place] one more than are open; 0: takes none
        self._told = memory[places * _WORD :].cast("d")  # [place] when that was written, monotonic seconds

    def tell(self, place: int, connections: int) -> None:
        """Say that the worker at a place has so many, and takes more."""
        self._told[place] = monotonic()
        self._connections[place] = connections + 1

    def withdraw(self, place: int) -> None:
        """Say that the worker at a place takes no more."""
        self._connections[place] = 0

    def fewest_of_others(self, place: int) -> int | None:
        """What the worker that has the fewest has, of those that take more; None where there is no other."""
        since = monotonic() - PATIENCE_S
        found = [
            number - 1
            for other, (number, told) in enumerate(zip(self._connections, self._told, strict=True))
            if other != place and number > 0 and told >= since
        ]
        return min(found, default=None)

    def is_ahead(self, place: int, connections: int) -> bool:
        """Whether the worker at a place, that has so many, should leave the next one to another."""
        fewest = self.fewest_of_others(place)
        return fewest is not None and connections > fewest + fewest // EVEN
