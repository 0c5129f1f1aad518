"""The largest number of sessions that a contestant serves in time."""

from collections.abc import Callable
from dataclasses import dataclass, replace

MOST_P99_MS = 10.0
"""99 % of the frames must be answered within this: a third of a frame's interval at 30 Hz."""

NEAR_P99_MS = 15.0
"""A failure below this may be the machine's and is tried again; one above it is a failure."""

STRIDE = 1.25
"""From one number to the next, up or down, until one is kept and one is not; each stride is longer by as much."""


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
    near: bool = False
    """Whether it failed by so little that another trial may keep."""


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
        first: where to begin: the nearer to the answer, the fewer trials.
        most: no more than so many.
        resolution: of the answer, as a share of it.
        attempts: a number that fails is tried so often while its failures are near, or prove nothing.
        confirm: in a long trial; where it says no, the answer is searched for from there down, to twice `resolution`.
    """
    found = _search(judge, first=first, most=most, resolution=resolution, attempts=attempts, stride=STRIDE)
    if confirm is None or not found.sessions:
        return found

    def long(sessions: int) -> Verdict:
        return replace(confirm(sessions), near=False)  # such a trial takes its time, and the next number is not far

    most, stride = found.sessions, 1.0 + resolution
    agreed = _search(long, first=most, most=most, resolution=2 * resolution, attempts=attempts, stride=stride)
    return agreed if agreed.sessions < found.sessions else found


def _search(judge: Judge, *, first: int, most: int, resolution: float, attempts: int, stride: float) -> Capacity:
    low, high, valid, number, growth = 0, most + 1, False, min(max(first, 1), most), stride
    while True:
        kept, sound = _try(judge, number, attempts)
        if kept:
            low = number
        else:
            high, valid = number, sound
        if high - low <= max(1, int(resolution * low)):
            return Capacity(low, bounded=valid and high <= most)
        if high > most:
            number = min(max(int(low * stride), low + 1), most)
        elif low == 0:
            number = max(min(int(high / stride), high - 1), 1)
        else:
            number = (low + high) // 2
        stride *= growth


def _try(judge: Judge, number: int, attempts: int) -> tuple[bool, bool]:
    """Whether a number is kept, and whether any failure was sound."""
    sound = False
    for _ in range(attempts):
        verdict = judge(number)
        if verdict.keeps:
            return True, True
        sound = sound or verdict.valid
        if verdict.valid and not verdict.near:
            break
    return False, sound
