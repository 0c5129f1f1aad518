"""Which frames wait for an answer, and which answers nobody has read yet.

Rules: a frame is answered once, by an estimate or by an error that names it · an answer that somebody awaits goes to
them, every other one into the inbox · what comes again after a replay was answered before and is dropped.
"""

import logging
from collections import deque
from collections.abc import Collection, Iterable

from fervor.errors import EngineError, FervorError
from fervor.protocol.messages import Estimate, Totals

logger = logging.getLogger("fervor_client")

UNREAD = 65_536
"""Estimates kept for a caller who does not read them (half an hour of one body); then the oldest go."""

Key = tuple[str, int]
"""A frame: its body and seq."""


class Answers:
    """The answers of one conversation."""

    def __init__(self, *, latest: bool) -> None:
        """`latest`: an estimate answers the older frames of its body too."""
        self._latest = latest
        self._waiting: dict[Key, None] = {}  # in the order sent
        self._echoes: set[Key] = set()  # answered before they were sent again
        self._awaited: dict[Key, Estimate | FervorError | None] = {}
        self._inbox: deque[Estimate] = deque()
        self._overflowed = False
        self._counts = Totals().model_dump()

    @property
    def in_flight(self) -> int:
        """Frames sent and not yet answered."""
        return len(self._waiting)

    @property
    def totals(self) -> Totals:
        """What the conversation came to, counted here, each frame once however often it was sent."""
        return Totals(**self._counts)

    def waits(self, key: Key) -> bool:
        """Whether this frame is under way."""
        return key in self._waiting

    def expect(self, key: Key, *, awaited: bool) -> None:
        """A frame is under way."""
        self._waiting[key] = None
        if awaited:
            self._awaited[key] = None

    def expect_again(self, keys: Iterable[Key]) -> None:
        """These frames, answered before, are sent again on a new connection."""
        self._echoes = set(keys)

    def settle(self, estimate: Estimate) -> list[Key] | None:
        """Take in an estimate.

        Returns:
            The frames it answers, its own or none among them; None if it is an echo and was dropped.
        """
        key = (estimate.body, estimate.seq)
        echo = key in self._echoes
        self._echoes.difference_update(self._reach(key, self._echoes))
        if echo:
            return None
        settled = self._reach(key, self._waiting)
        for frame in settled:
            del self._waiting[frame]
            if frame in self._awaited:
                self._awaited[frame] = estimate
        self._count(estimate, max(len(settled), 1))
        if key not in self._awaited:
            self._keep(estimate)
        return settled

    def refuse(self, key: Key, error: FervorError) -> bool | None:
        """Take in an error that names a frame: whether somebody awaits it; None if it is an echo and was dropped."""
        if key in self._echoes:
            self._echoes.discard(key)
            return None
        self._waiting.pop(key, None)
        self._counts["frames" if isinstance(error, EngineError) else "rejected"] += 1
        if key in self._awaited:
            self._awaited[key] = error
            return True
        return False

    def count_reset(self) -> None:
        """The caller reset a body."""
        self._counts["resets"] += 1

    def next(self) -> Estimate | None:
        """The oldest unread estimate, if there is one."""
        return self._inbox.popleft() if self._inbox else None

    def take(self, key: Key) -> Estimate | None:
        """The answer to an awaited frame; None if it has not come. Raises the error that refused it."""
        answer = self._awaited.get(key)
        if isinstance(answer, FervorError):
            raise answer
        return answer

    def give_up(self, key: Key) -> None:
        """Nobody awaits this frame any more."""
        self._awaited.pop(key, None)

    def _reach(self, key: Key, frames: Collection[Key]) -> list[Key]:
        """Those of `frames` that an estimate answers: its own, and those that delivery `latest` skipped for it."""
        if not self._latest:
            return [key] if key in frames else []
        body, seq = key
        return [frame for frame in frames if frame[0] == body and frame[1] <= seq]

    def _count(self, estimate: Estimate, frames: int) -> None:
        if "duplicate" in estimate.flags:
            self._counts["duplicate"] += 1
            return
        self._counts["frames"] += frames
        self._counts["estimates"] += frames
        self._counts["late"] += "late" in estimate.flags
        self._counts["resets"] += "gap_reset" in estimate.flags or "clock_reset" in estimate.flags

    def _keep(self, estimate: Estimate) -> None:
        self._inbox.append(estimate)
        if len(self._inbox) <= UNREAD:
            return
        self._inbox.popleft()
        if not self._overflowed:
            logger.warning("%d estimates are unread; from now on the oldest are dropped", UNREAD)
        self._overflowed = True
