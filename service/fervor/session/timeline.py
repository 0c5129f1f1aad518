"""Client times to the model's grid: which steps a new pose brings, and where between two poses they lie.

Rules, all functions of the frames' times alone, so that a replay repeats them (times in seconds, client clock):
the first pose after a reset is step 0 and sets the grid · a pose brings every grid step since the pose before it ·
a gap up to `INTERPOLATE_S` is interpolated · up to `HOLD_S` the steps inside it hold the old pose, unobserved ·
a longer one starts anew · so does a clock that ran back by more than `HOLD_S`; less than that is a late frame.
"""

from typing import Literal

import msgspec

INTERPOLATE_S = 0.25
"""Longest gap between two poses that is bridged by SLERP."""

HOLD_S = 1.0
"""Longest gap that keeps the recurrent state alive; also how far a clock may run back and count as late."""

SAME_INSTANT_S = 1e-6
"""Times closer than this are the same instant: client arithmetic rounds."""

TimelineFlag = Literal["between_steps", "interpolated", "held", "gap_reset", "clock_reset", "late"]


class Instant(msgspec.Struct, frozen=True, gc=False):
    """One step of the grid."""

    index: int
    """Steps since the reset."""
    time: float  # seconds
    fraction: float
    """Where between the pose before (0) and the new one (1)."""
    held: bool
    """Inside a gap too long to interpolate: the old pose stays, unobserved."""


class Timeline(msgspec.Struct, frozen=True, gc=False):
    """Where a body stands on its grid."""

    origin: float  # seconds, time of step 0
    last: float  # seconds, time of the newest pose
    steps: int
    """Steps taken since the reset; also the index of the next one."""


class Advance(msgspec.Struct, frozen=True, gc=False):
    """What one pose did to a timeline."""

    timeline: Timeline | None
    instants: tuple[Instant, ...] = ()
    flags: tuple[TimelineFlag, ...] = ()
    fresh: bool = False
    """The body starts anew with this pose."""


def begin(time: float, *flags: TimelineFlag) -> Advance:
    """The first pose after a reset."""
    return Advance(Timeline(time, time, 1), (Instant(0, time, 1.0, held=False),), flags, fresh=True)


def advance(timeline: Timeline | None, time: float, *, rate_hz: float) -> Advance:
    """The steps that a pose at `time` (seconds) brings to a grid of `rate_hz`; a late one brings none."""
    if timeline is None:
        return begin(time)
    last = timeline.last
    gap = time - last
    if not 0.0 < gap <= HOLD_S + SAME_INSTANT_S:
        return _apart(timeline, time, gap)
    held = gap > INTERPOLATE_S + SAME_INSTANT_S
    origin, index, until = timeline.origin, timeline.steps, time + SAME_INSTANT_S
    instants: list[Instant] = []
    while (at := origin + index / rate_hz) <= until:
        inside = held and at < time - SAME_INSTANT_S
        instants.append(Instant(index, at, min((at - last) / gap, 1.0), inside))
        index += 1
    flags: tuple[TimelineFlag, ...] = ()
    if held:
        flags = ("held",)
    elif len(instants) != 1:
        flags = ("interpolated",) if instants else ("between_steps",)
    return Advance(Timeline(origin, time, index), tuple(instants), flags)


def _apart(timeline: Timeline, time: float, gap: float) -> Advance:
    """A pose so far from the one before it, or before that, that nothing lies between."""
    if gap > 0.0:
        return begin(time, "gap_reset")
    if gap < -HOLD_S:
        return begin(time, "clock_reset")
    return Advance(timeline, flags=("late",))


def count_frame(timeline: Timeline | None, time: float) -> Advance:
    """Clock `frames`: every pose is one step, whatever its time."""
    if timeline is None:
        return begin(time)
    instant = Instant(timeline.steps, time, 1.0, held=False)
    return Advance(Timeline(timeline.origin, time, timeline.steps + 1), (instant,))
