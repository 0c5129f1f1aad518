"""Lanes: the recurrent states a body keeps side by side, so that a stream may last for hours.

A network trained on clips of seconds must not run for minutes on one state. `staggered` keeps two lanes, each
restarted every `PERIOD_S`, half a period apart; the older one speaks, and hands over in a cross-fade of `FADE_S` that
ends where it restarts. `stateful` is the paper's: one lane, never restarted. `window` has no state at all: every step
runs the last `WINDOW_S` of poses from zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import Memory

LANES = 2
"""Most lanes any kind of memory needs."""

PERIOD_S = 8.0
FADE_S = 0.5
WINDOW_S = 4.0


@dataclass(frozen=True, slots=True)
class LaneStep:
    """What one lane does in one step."""

    lane: int
    restart: bool
    """Its state is zero before this step."""
    weight: float
    """Its share of the estimate; the shares of a step add up to 1."""


NO_LANES = 0
"""Row of every lane plan in which no lane runs: a window's."""

Schedule = tuple[LaneStep, ...]

_ALONE: Schedule = (LaneStep(0, restart=False, weight=1.0),)


def schedule(memory: Memory, index: int, rate_hz: float) -> Schedule:
    """The lanes that run in step `index` since the reset (index 0 restarts lane 0); none for `window`."""
    if memory == "window":
        return ()
    if memory == "stateful":
        return (LaneStep(0, restart=True, weight=1.0),) if index == 0 else _ALONE
    opening, cycle = _staggered(rate_hz)
    return opening[index] if index < len(opening) else cycle[index % len(cycle)]


@dataclass(frozen=True, slots=True, eq=False)
class LanePlan:
    """All schedules of one rate as arrays, so that steps of many bodies are laid out together: a row a schedule."""

    period: int  # steps
    runs: npt.NDArray[np.bool_]  # [row, lane]
    restart: npt.NDArray[np.bool_]  # [row, lane]
    weight: npt.NDArray[np.float64]  # [row, lane], zero where a lane does not run
    full: frozenset[int]
    """Rows in which every lane runs."""
    restarting: frozenset[int]
    """Rows in which any lane restarts."""

    def row(self, memory: Memory, index: int) -> int:
        """Where `schedule` of step `index` stands."""
        if memory == "staggered":  # the first period, then so many rows for every later one
            return 3 + index if index < self.period else 3 + self.period + index % self.period
        if memory == "window":
            return NO_LANES
        return 1 if index == 0 else 2


@cache
def lane_plan(rate_hz: float) -> LanePlan:
    """The schedules of a rate."""
    opening, cycle = _staggered(rate_hz)
    alike = ((), schedule("stateful", 0, rate_hz), _ALONE)
    rows: Sequence[Schedule] = (*alike, *opening, *cycle)
    runs, restart = (np.zeros((len(rows), LANES), np.bool_) for _ in range(2))
    weight = np.zeros((len(rows), LANES))
    for row, lanes in enumerate(rows):
        for step in lanes:
            runs[row, step.lane], restart[row, step.lane], weight[row, step.lane] = True, step.restart, step.weight
    full, restarting = (frozenset(np.flatnonzero(which).tolist()) for which in (runs.all(axis=1), restart.any(axis=1)))
    return LanePlan(len(cycle), runs, restart, weight, full, restarting)


def window_steps(memory: Memory, rate_hz: float) -> int:
    """Steps in the window; 0 for memories that have a state instead."""
    return max(round(WINDOW_S * rate_hz), 1) if memory == "window" else 0


@cache
def _staggered(rate_hz: float) -> tuple[tuple[Schedule, ...], tuple[Schedule, ...]]:
    """The first period, in which lane 1 is still to come, and every later one."""
    half = max(round(PERIOD_S * rate_hz / 2), 1)  # steps
    fade = min(round(FADE_S * rate_hz), half - 1)
    opening: list[Schedule] = [(LaneStep(0, restart=index == 0, weight=1.0),) for index in range(half)]
    opening += [_pair(index, half, fade) for index in range(half, 2 * half)]
    return tuple(opening), tuple(_pair(index, half, fade) for index in range(2 * half))


def _pair(index: int, half: int, fade: int) -> Schedule:
    elder = 0 if index >= half else 1
    until_restart = half - index % half  # steps
    younger_share = max(fade + 1 - until_restart, 0) / (fade + 1)
    weights = (1.0 - younger_share, younger_share) if elder == 0 else (younger_share, 1.0 - younger_share)
    return (LaneStep(0, index == 0, weights[0]), LaneStep(1, index == half, weights[1]))


@dataclass(frozen=True, slots=True)
class LaneRun:
    """What one lane does between two restarts, as far as it is heard."""

    lane: int
    start: int
    """The step that restarts it."""
    stop: int
    """The step after the last one in which it has a share of the estimate."""


def lane_weights(memory: Memory, steps: int, rate_hz: float) -> npt.NDArray[np.float64]:
    """The share of each lane in the first `steps` after a reset, [step, lane]; what `schedule` says step by step."""
    weights = np.zeros((steps, LANES))
    if memory == "stateful":
        weights[:, 0] = 1.0
    else:
        opening, cycle = _staggered_weights(rate_hz)
        repeats = max(-(-(steps - len(opening)) // len(cycle)), 0)
        weights[:] = np.concatenate([opening, *[cycle] * repeats])[:steps]
    return weights


def lane_runs(memory: Memory, steps: int, rate_hz: float) -> list[LaneRun]:
    """What the lanes do in the first `steps` after a reset; a lane that is not heard any more need not run."""
    if memory == "stateful":
        return [LaneRun(0, 0, steps)]
    period = len(_staggered(rate_hz)[1])
    weights = lane_weights(memory, steps, rate_hz)
    runs = []
    for lane in range(LANES):
        for start in range(lane * period // LANES, steps, period):
            heard = np.flatnonzero(weights[start : start + period, lane])
            if len(heard):
                runs.append(LaneRun(lane, start, start + int(heard[-1]) + 1))
    return runs


@cache
def _staggered_weights(rate_hz: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The shares [step, lane] of the first period, and of every later one."""
    tables = []
    for schedules in _staggered(rate_hz):
        table = np.zeros((len(schedules), LANES))
        for index, lanes in enumerate(schedules):
            for lane in lanes:
                table[index, lane.lane] = lane.weight
        tables.append(table)
    return tables[0], tables[1]
