"""The largest number of sessions that a contestant serves in time."""

from collections.abc import Callable
from dataclasses import dataclass

MOST_P99_MS = 10.0
"""99 % of the frames must be answered within this: a third of a frame's interval at 30 Hz."""


@dataclass(frozen=True, slots=True)
class Capacity:
    """How many sessions were kept."""

    sessions: int
    """Largest number seen kept; 0 where none was."""
    bounded: bool
    """Whether a number above it was seen to fail; else the generator or the limit ended the search."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a trial says of a number of sessions."""

    keeps: bool
    """The generator's lag is part of a latency, so what keeps with it would keep without."""
    valid: bool
    """A trial that fails proves nothing where the generator did."""


Judge = Callable[[int], Verdict]
"""Tries a number of sessions."""


def find_capacity(
    judge: Judge,
    *,
    first: int,
    most: int,
    resolution: float = 0.05,
    attempts: int = 2,
    confirm: Judge | None = None,
) -> Capacity:
    """Bracket the largest number that is kept, halve the bracket, and have the answer confirmed.

    Args:
        judge: in a short trial.
        first: where to begin.
        most: no more than so many.
        resolution: of the answer, as a share of it.
        attempts: a number fails when so many trials in a row fail: neighbours on the machine cost some.
        confirm: in a long trial; where it says no, it is asked for a number smaller by `resolution`, until it agrees.
    """
    found = _search(judge, first=first, most=most, resolution=resolution, attempts=attempts)
    while confirm is not None and found.sessions:
        kept, sound = _try(confirm, found.sessions, attempts)
        if kept:
            break
        found = Capacity(min(int(found.sessions * (1.0 - resolution)), found.sessions - 1), bounded=sound)
    return found


def _search(judge: Judge, *, first: int, most: int, resolution: float, attempts: int) -> Capacity:
    low, high, valid, number = 0, most + 1, False, min(max(first, 1), most)
    while True:
        kept, sound = _try(judge, number, attempts)
        if kept:
            low = number
        else:
            high, valid = number, sound
        if high - low <= max(1, int(resolution * low)):
            return Capacity(low, bounded=valid and high <= most)
        number = min(number * 2, most) if high > most else max((low + high) // 2, 1)


def _try(judge: Judge, number: int, attempts: int) -> tuple[bool, bool]:
    """Whether a number is kept, and whether any failure was sound."""
    sound = False
    for _ in range(attempts):
        verdict = judge(number)
        if verdict.keeps:
            return True, True
        sound = sound or verdict.valid
    return False, sound
