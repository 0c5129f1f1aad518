"""The poses of a whole take on the model's grid: what `fervor.session.timeline` says pose by pose, in arrays.

The same arithmetic on the same numbers in the same order, so the same bits; a test compares the two.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fervor.protocol.messages import Clock, Flag
from fervor.session.timeline import HOLD_S, INTERPOLATE_S, SAME_INSTANT_S

Times = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

FLAGS: tuple[tuple[Flag, ...], ...] = ((), ("between_steps",), ("interpolated",), ("held",), ("gap_reset",))
"""What a pose can be flagged with, by number."""

_BETWEEN, _INTERPOLATED, _HELD, _RESET = range(1, 5)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Which steps the poses of a take bring, and where between two poses they lie."""

    starts: Places  # [run] poses with which the body starts anew, the first one among them
    since: Times  # [pose] seconds, time of the last start
    flags: npt.NDArray[np.uint8]  # [pose] places in `FLAGS`
    last: Places  # [pose] its last step, or the one before where it brings none
    moves: npt.NDArray[np.bool_]  # [pose] whether it brings any
    pose: Places  # [step] the pose that brings it
    fraction: Times  # [step] 0 at the pose before, 1 at that pose
    held: npt.NDArray[np.bool_]  # [step] the pose before stays, unobserved
    first: Places  # [run + 1] first step of each run, and the number of steps

    @property
    def pose_runs(self) -> list[tuple[int, int]]:
        """First pose of each run, and the one after its last."""
        bounds = [*self.starts.tolist(), len(self.since)]
        return list(pairwise(bounds))

    @property
    def runs(self) -> list[tuple[int, int]]:
        """First step of each run, and the one after its last."""
        bounds = self.first.tolist()
        return list(pairwise(bounds))


def rises(times: Times) -> bool:
    """Whether every pose is later than the one before: what `grid_of` takes."""
    return bool((times[1:] > times[:-1]).all())


def grid_of(times: Times, clock: Clock, rate_hz: float) -> Grid:
    """The grid of poses at `times` [pose] seconds; by clock `time` they rise."""
    if clock == "frames" or not len(times):
        return _counted(times)
    with np.errstate(over="ignore"):
        gaps = np.diff(times)
    starts = np.concatenate([[0], np.flatnonzero(gaps > HOLD_S + SAME_INSTANT_S) + 1])
    bounds = zip(starts.tolist(), [*starts[1:].tolist(), len(times)], strict=True)
    runs = [_run(times[start:stop], start, rate_hz) for start, stop in bounds]
    first = np.cumsum([0, *(len(pose) for pose, _, _ in runs)])
    pose, fraction, held = (np.concatenate(parts) for parts in zip(*runs, strict=True))
    brought = np.bincount(pose, minlength=len(times))  # [pose] steps
    flags = np.where(brought == 0, _BETWEEN, np.where(brought > 1, _INTERPOLATED, 0)).astype(np.uint8)
    flags[1:][gaps > INTERPOLATE_S + SAME_INSTANT_S] = _HELD
    flags[starts] = _RESET
    flags[0] = 0
    since = np.repeat(times[starts], np.diff([*starts.tolist(), len(times)]))
    return Grid(starts, since, flags, np.cumsum(brought) - 1, brought > 0, pose, fraction, held, first)


def _run(times: Times, start: int, rate_hz: float) -> tuple[Places, Times, npt.NDArray[np.bool_]]:
    """Pose, fraction and held of the steps [step] of poses without a reset among them."""
    origin, end = times[0], times[-1]
    most = 1
    if len(times) > 1:  # no gap is long, so times are small enough to count steps between them
        most = int((end - origin + 2.0 * np.spacing(max(abs(origin), abs(end)))) * rate_hz) + 3
    at = origin + np.arange(most) / rate_hz  # [step] seconds
    at = at[at <= end + SAME_INSTANT_S]
    pose = np.searchsorted(times + SAME_INSTANT_S, at)
    pose[1:] = np.maximum(pose[1:], 1)  # the first pose brings the first step alone
    came = times[pose]
    before = times[np.maximum(pose - 1, 0)]
    gap = came - before
    gap[0] = 1.0
    fraction = np.minimum((at - before) / gap, 1.0)
    fraction[0] = 1.0
    held = (gap > INTERPOLATE_S + SAME_INSTANT_S) & (at < came - SAME_INSTANT_S)
    held[0] = False
    return pose + start, fraction, held


def _counted(times: Times) -> Grid:
    """Clock `frames`: every pose is one step."""
    count = len(times)
    places = np.arange(count)
    return Grid(
        starts=np.arange(min(count, 1)),
        since=np.repeat(times[:1], count),
        flags=np.zeros(count, np.uint8),
        last=places,
        moves=np.ones(count, np.bool_),
        pose=places,
        fraction=np.ones(count),
        held=np.zeros(count, np.bool_),
        first=np.array([0, count] if count else [0]),
    )
