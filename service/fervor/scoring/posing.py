"""The poses of a whole take, from its source's joints to what the model eats: `fervor.engine.posing`, over time.

The same functions where they go by rows anyway; where a pose depends on the one before, an equal rule in arrays. Long
takes are worked off in blocks that stay in the cache.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from fervor.engine.posing import JUMP_RAD, Poses, hold, reject_jumps
from fervor.model import Floats
from fervor.rotations import IDENTITY, angle_between, slerp
from fervor.scoring.grid import Grid
from fervor.session.events import Source
from fervor.skeletons.adapter import adapt
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.positions import local_over_time
from fervor.skeletons.rig import JOINTS

BLOCK = 512
"""Poses that are worked on together."""

Mask = npt.NDArray[np.bool_]


def poses_over_time(
    source: Source, joints: npt.NDArray[np.float64], observed: Mask, starts: npt.NDArray[np.intp]
) -> tuple[Poses, Mask]:
    """Poses in the rig C13, holes held, and which of them had joints rejected as jumps [pose].

    Args:
        source: what the joints are.
        joints: [pose, joint, 4] xyzw, or [pose, joint, 3] of landmarks; every pose with some joint observed.
        observed: [pose, joint].
        starts: [run] poses with which the body starts anew, the first one among them.
    """
    came = _adapt(source, joints, observed, starts)
    jumped = np.zeros(len(joints), np.bool_)
    held = _hold(came, starts)
    if source.skeleton.noisy and _jumps(came.observed, held.rotations, starts):
        held, jumped = _reject(came, starts)
    return held, jumped


def steps_over_time(poses: Poses, grid: Grid) -> tuple[Floats, Floats]:
    """Rotations [step, 13, 4] and mask [step, 13] at the steps of a grid: see `fervor.engine.posing.between`."""
    rotations = np.empty((len(grid.pose), len(JOINTS), 4), np.float32)
    mask = np.empty(rotations.shape[:2], np.float32)
    for block in _blocks(len(grid.pose)):
        new, fraction, held = grid.pose[block], grid.fraction[block], grid.held[block]
        rotations[block], mask[block] = poses.rotations[new], poses.observed[new]
        under_way = np.flatnonzero((fraction < 1.0) | held)
        if len(under_way):
            new, fraction, held = new[under_way], fraction[under_way], held[under_way]
            rows = under_way + block.start
            mask[rows] = poses.observed[new] & poses.observed[new - 1] & ~held[:, None]
            rotations[rows] = _between(poses.rotations, new, fraction, held)
    return rotations, mask


def _between(
    rotations: npt.NDArray[np.float64],  # [pose, joint, 4]
    new: npt.NDArray[np.intp],  # [step] place of the pose after
    fraction: npt.NDArray[np.float64],  # [step]
    held: Mask,  # [step]
) -> npt.NDArray[np.float64]:
    """Rotations [step, joint, 4] before the arrival at a new pose, or where the one before stays."""
    old = rotations[new - 1]
    turning = np.flatnonzero(~held)
    share = np.broadcast_to(fraction[turning, None], (len(turning), rotations.shape[1]))
    old[turning] = slerp(old[turning], rotations[new[turning]], share)
    return old


def _adapt(source: Source, joints: npt.NDArray[np.float64], observed: Mask, starts: npt.NDArray[np.intp]) -> Poses:
    """Poses in the rig C13 as they came."""
    rotations = np.empty((len(joints), len(JOINTS), 4))
    seen = np.empty(rotations.shape[:2], np.bool_)
    if isinstance(source.skeleton, Landmarks):
        for run in _runs(starts, len(joints)):  # limbs are forgotten in between
            rotations[run], seen[run] = local_over_time(source.skeleton, joints[run], observed[run])
    else:
        for block in _blocks(len(joints)):
            adapted = adapt(source.skeleton, joints[block], observed[block], axes=source.axes)
            rotations[block], seen[block] = adapted
    return Poses(rotations, seen)


def _hold(came: Poses, starts: npt.NDArray[np.intp]) -> Poses:
    """Unobserved joints keep the rotation they had last; the identity, if they were never seen."""
    if came.observed.all():
        return came
    count = len(came.observed)
    first = np.repeat(starts, np.diff([*starts.tolist(), count]))  # [pose] the start of its run
    last = np.maximum.accumulate(np.where(came.observed, np.arange(count)[:, None], -1), axis=0)  # [pose, joint]
    known = last >= first[:, None]
    rotations = came.rotations[np.where(known, last, 0), np.arange(len(JOINTS))]
    return Poses(np.where(known[..., None], rotations, IDENTITY), came.observed)


def _jumps(observed: Mask, rotations: npt.NDArray[np.float64], starts: npt.NDArray[np.intp]) -> bool:
    """Whether any joint turns too far between two poses that show it."""
    continued = np.ones(len(observed), np.bool_)
    continued[starts] = False
    for block in _blocks(len(observed) - 1):
        old, new = rotations[block], rotations[block.start + 1 : block.stop + 1]
        both = observed[block] & observed[block.start + 1 : block.stop + 1]
        both &= continued[block.start + 1 : block.stop + 1, None]
        if (both & (angle_between(old, new) > JUMP_RAD)).any():
            return True
    return False


def _reject(came: Poses, starts: npt.NDArray[np.intp]) -> tuple[Poses, Mask]:
    """Poses, holes and jumps held, and which had jumps [pose]: pose by pose, as each hangs on those before."""
    rotations, observed = np.empty_like(came.rotations), np.empty_like(came.observed)
    jumped = np.zeros(len(observed), np.bool_)
    noisy = np.ones(1, np.bool_)
    for run in _runs(starts, len(observed)):
        old = Poses(np.tile(IDENTITY, (1, len(JOINTS), 1)), np.zeros((1, len(JOINTS)), np.bool_))
        jumps = np.zeros((1, len(JOINTS)), np.int64)
        for pose in range(run.start, run.stop):
            new = Poses(came.rotations[pose : pose + 1], came.observed[pose : pose + 1])
            new, jumps, rejected = reject_jumps(new, old, jumps, noisy)
            old = hold(new, old)
            rotations[pose], observed[pose], jumped[pose] = old.rotations[0], old.observed[0], rejected.any()
    return Poses(rotations, observed), jumped


def _runs(starts: npt.NDArray[np.intp], count: int) -> Iterator[slice]:
    bounds = [*starts.tolist(), count]
    return map(slice, bounds[:-1], bounds[1:])


def _blocks(count: int) -> Iterator[slice]:
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))
