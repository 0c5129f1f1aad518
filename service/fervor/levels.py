"""Intensity to level: a threshold per emotion with hysteresis and dwell, a pure function of intensities and times."""

from collections.abc import Iterable
from enum import StrEnum

import msgspec


class Level(StrEnum):
    """How strongly an emotion shows: weak below the threshold, strong above, with hysteresis between."""

    WEAK = "weak"
    STRONG = "strong"


class LevelState(msgspec.Struct, frozen=True, gc=False):
    """The level of one body, and since when."""

    level: Level
    since: float  # seconds, client clock


def next_level(
    state: LevelState | None,
    *,
    intensity: float,
    time: float,
    threshold: float,
    hysteresis: float,
    dwell: float,
) -> LevelState:
    """The level after an intensity in [0, 1] at `time` (seconds, client clock).

    A level changes only when the intensity leaves the band `threshold` ± `hysteresis` on the other side and the level
    has been held for `dwell` seconds. The first estimate is strong from the band's upper edge on, without a dwell: a
    robot acts on strong, so strong is never said for want of a level before.
    """
    if state is None:
        return LevelState(Level.STRONG if intensity >= threshold + hysteresis else Level.WEAK, time)
    if time - state.since < dwell:
        return state
    if state.level is Level.WEAK and intensity >= threshold + hysteresis:
        return LevelState(Level.STRONG, time)
    if state.level is Level.STRONG and intensity < threshold - hysteresis:
        return LevelState(Level.WEAK, time)
    return state


def levels_over_time(
    intensities: Iterable[float], times: Iterable[float], *, threshold: float, hysteresis: float, dwell: float
) -> list[Level]:
    """The level after each of many intensities, of which the first is the first estimate; the same as `next_level`."""
    levels: list[Level] = []
    level, since = None, 0.0
    up, down = threshold + hysteresis, threshold - hysteresis
    for intensity, time in zip(intensities, times, strict=True):
        if level is None:
            level, since = (Level.STRONG if intensity >= up else Level.WEAK), time
        elif time - since >= dwell and (intensity >= up if level is Level.WEAK else intensity < down):
            level, since = (Level.STRONG if level is Level.WEAK else Level.WEAK), time
        levels.append(level)
    return levels
