"""The fast way to score: whole takes in arrays, and the model over whole sequences of all of them.

Equal to the plain way (`fervor.scoring.stepwise`) to the bit, as a test holds, for what `fits` says.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fervor.emotions import UNKNOWN
from fervor.levels import Level, levels_over_time
from fervor.model import Floats, Model
from fervor.protocol.messages import Flag, Status
from fervor.scoring.grid import FLAGS, Grid, grid_of, rises
from fervor.scoring.posing import poses_over_time, steps_over_time
from fervor.scoring.scored import Scored
from fervor.scoring.sequences import Row, Said, Steps, run_rows
from fervor.scoring.take import Take
from fervor.session.body import WARM_UP_S, Terms, enough_joints
from fervor.session.label import Label
from fervor.session.lanes import LANES, lane_runs, lane_weights
from fervor.skeletons.rig import UPPER_BODY

STATUSES: tuple[Status, ...] = ("ok", "warming_up", "insufficient")
"""By number."""


def fits(take: Take, terms: Terms) -> bool:
    """Whether a take can be scored this way: a memory with states, a label that holds, and times that rise."""
    label = take.label(terms)
    return (
        terms.memory != "window"
        and (label.until is None or math.isinf(label.until))
        and (terms.clock == "frames" or rises(take.times[_posed(take)]))
    )


def score_whole(
    model: Model, takes: Sequence[Take], terms: Terms, *, row_multiple: int, progress: Callable[[int], None]
) -> list[Scored]:
    """Score takes that fit.

    Raises:
        EngineError: the model failed.
    """
    motions = [_Motion.of(take, replace(terms, source=take.source or terms.source)) for take in takes]
    first = np.cumsum([0, *(len(motion.mask) for motion in motions)]).tolist()
    steps = Steps(
        np.concatenate([motion.rotations for motion in motions]),
        np.concatenate([motion.mask for motion in motions]),
        np.stack([motion.label.vector for motion in motions]),
    )
    rows = [row for number, motion in enumerate(motions) for row in motion.rows(first[number], number)]
    told = _Share(sum(map(len, takes)), sum(map(len, rows)), progress)
    said = run_rows(model, steps, rows, by_emotion=terms.by_emotion, row_multiple=row_multiple, progress=told.add)
    told.finish()
    return [
        motion.conclude(said.cut(start, stop)) for motion, (start, stop) in zip(motions, pairwise(first), strict=True)
    ]


def _posed(take: Take) -> npt.NDArray[np.bool_]:
    """Which frames [frame] show anything."""
    return np.asarray(take.observed.any(axis=1), np.bool_)


class _Share:
    """Tells progress in frames, as steps are done."""

    def __init__(self, frames: int, steps: int, tell: Callable[[int], None]) -> None:
        self._frames = frames
        self._steps = steps
        self._tell = tell
        self._done = self._told = 0

    def add(self, steps: int) -> None:
        """So many steps more."""
        self._done += steps
        self._tell_up_to(self._frames * self._done // self._steps)

    def finish(self) -> None:
        """Every frame is done, those without steps too."""
        self._tell_up_to(self._frames)

    def _tell_up_to(self, frames: int) -> None:
        if frames > self._told:
            self._tell(frames - self._told)
            self._told = frames


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """One take on the model's grid."""

    take: Take
    terms: Terms
    label: Label
    posed: npt.NDArray[np.bool_]  # [frame] whether it shows anything
    grid: Grid
    seen: npt.NDArray[np.intp]  # [pose] upper-body joints observed
    jumped: npt.NDArray[np.bool_]  # [pose] whether joints were rejected
    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]

    @classmethod
    def of(cls, take: Take, terms: Terms) -> "_Motion":
        posed = _posed(take)
        grid = grid_of(take.times[posed], terms.clock, terms.metadata.rate_hz)
        poses, jumped = poses_over_time(terms.source, take.rotations[posed], take.observed[posed], grid.starts)
        seen = poses.observed[:, UPPER_BODY].sum(axis=1)
        return cls(take, terms, take.label(terms), posed, grid, seen, jumped, *steps_over_time(poses, grid))

    def rows(self, first: int, emotion: int) -> list[Row]:
        """What its lanes do, its first step being step `first` of all."""
        memory, rate = self.terms.memory, self.terms.metadata.rate_hz
        return [
            Row(run.lane, first + begin + run.start, first + begin + run.stop, emotion)
            for begin, end in self.grid.runs
            for run in lane_runs(memory, end - begin, rate)
        ]

    def conclude(self, said: Said) -> Scored:
        """The estimates, from what the lanes said in its steps."""
        newest = np.cumsum(self.posed) - 1  # [frame] the pose it shows, or the last one before; -1 before the first
        unknown = int((newest < 0).sum())
        step = self.grid.last[newest[unknown:]]  # [frame from the first pose on]
        weights = self._weights()
        intensity = np.full(len(self.take), np.nan)
        intensity[unknown:] = _blend(weights, said.intensity[..., None])[step, 0]
        by_emotion = None
        if said.by_emotion is not None:
            by_emotion = np.full((len(self.take), said.by_emotion.shape[2]), np.nan)
            by_emotion[unknown:] = _blend(weights, said.by_emotion)[step]
        return Scored(
            name=self.take.name,
            times=self.take.times,
            intensity=intensity,
            by_emotion=by_emotion,
            levels=[*[None] * unknown, *self._levels(intensity[self.posed], newest[unknown:])],
            emotions=[*[UNKNOWN] * unknown, *[self.label.name] * (len(self.take) - unknown)],
            statuses=self._statuses(),
            flags=self._flags(),
        )

    def _weights(self) -> npt.NDArray[np.float64]:
        """The share of each lane in each step, [step, lane]."""
        memory, rate = self.terms.memory, self.terms.metadata.rate_hz
        weights = [lane_weights(memory, end - begin, rate) for begin, end in self.grid.runs]
        return np.concatenate([np.zeros((0, LANES)), *weights])

    def _levels(self, intensity: npt.NDArray[np.float64], newest: npt.NDArray[np.intp]) -> list[Level]:
        """The level of every frame that shows or follows a pose; poses without a step keep the one before."""
        rule = self.terms.metadata.levels
        times = self.take.times[self.posed]
        moves = self.grid.moves
        levels: list[Level] = []
        for start, stop in self.grid.pose_runs:
            at = start + np.flatnonzero(moves[start:stop])
            levels += levels_over_time(
                intensity[at].tolist(),
                times[at].tolist(),
                threshold=rule.threshold[self.label.name],
                hysteresis=rule.hysteresis,
                dwell=rule.dwell_s,
            )
        held = np.cumsum(moves) - 1  # [pose] the level it has
        return [levels[place] for place in held[newest].tolist()]

    def _statuses(self) -> list[Status]:
        codes = np.full(len(self.take), STATUSES.index("insufficient"))
        early = self.take.times[self.posed] - self.grid.since < WARM_UP_S
        enough = self.seen >= enough_joints(self.terms)
        codes[self.posed] = np.where(enough, np.where(early, 1, 0), 2)
        return [STATUSES[code] for code in codes.tolist()]

    def _flags(self) -> list[tuple[Flag, ...]]:
        codes = np.full(len(self.take), len(FLAGS) * 2)
        codes[self.posed] = self.grid.flags + len(FLAGS) * self.jumped
        return [_FRAME_FLAGS[code] for code in codes.tolist()]


_FRAME_FLAGS: tuple[tuple[Flag, ...], ...] = (*FLAGS, *((*flags, "jump") for flags in FLAGS), ("lost",))
"""What a frame can be flagged with: as its pose was, with joints that jumped too, or that there was none."""


def _blend(weights: npt.NDArray[np.float64], said: Floats) -> npt.NDArray[np.float64]:
    """What the lanes say [lane, step, k], weighted into one a step [step, k]; in the engine's order of sums."""
    blended = np.zeros(said.shape[1:])
    for lane in range(LANES):
        blended += weights[:, lane, None] * said[lane]
    return blended
