"""From the poses of a batch of tickets to what the model eats, step by step. Pure functions on arrays.

Elementwise throughout: no row can depend on its neighbours in the batch.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, angle_between, dot, slerp
from fervor.session.events import Pose, Source, Ticket
from fervor.skeletons.adapter import adapt
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.positions import local_from_positions
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.skeleton import Skeleton

JUMP_RAD = np.radians(120.0)
"""A noisy sensor's joint that turns further than this in one frame has flipped, not moved."""

_SURELY_NEAR = np.cos(JUMP_RAD / 2.0) + 1e-3
"""Quaternions with a greater product are nearer than that, whatever the last bits."""

JUMPS_BELIEVED = 5
"""A rotation that was rejected this often in a row is believed: the sensor settled there."""


class Poses(NamedTuple):
    """Canonical poses of a batch."""

    rotations: npt.NDArray[np.float64]  # [row, joint, 4] xyzw
    observed: npt.NDArray[np.bool_]  # [row, joint]

    def rows(self, which: npt.NDArray[Any]) -> "Poses":
        """Some of them, by number or by mask."""
        return Poses(self.rotations[which], self.observed[which])


class Came(NamedTuple):
    """What a batch of tickets brings."""

    poses: Poses  # identity and unobserved, where a ticket has none
    posed: npt.NDArray[np.intp] | None  # the tickets with a pose, by number; None where all have one
    hinges: npt.NDArray[np.float64] | None
    """[row, limb, bone, 3] what is to be remembered of limbs; None where nobody has a landmark sensor."""


def adapt_all(tickets: Sequence[Ticket], hinges: npt.NDArray[np.float64]) -> Came:
    """The tickets' poses in the rig C13; tickets of one source are adapted in one go.

    Args:
        tickets: the batch.
        hinges: [row, limb, bone, 3] what landmark sensors remember of each body's limbs.
    """
    poses = [ticket.pose for ticket in tickets if ticket.pose is not None]
    source = tickets[0].source
    others = len(poses) < len(tickets) or [ticket for ticket in tickets if ticket.source is not source]
    if not others and isinstance(source.skeleton, Skeleton):
        return Came(Poses(*adapt(source.skeleton, *_stacked(poses), axes=source.axes)), None, None)
    return _adapt_by_source(tickets, hinges)


def _adapt_by_source(tickets: Sequence[Ticket], hinges: npt.NDArray[np.float64]) -> Came:
    """As `adapt_all`, of any sources."""
    by_source: dict[Source, list[int]] = {}
    posed = [row for row, ticket in enumerate(tickets) if ticket.pose is not None]
    for row in posed:
        by_source.setdefault(tickets[row].source, []).append(row)
    rotations = np.tile(IDENTITY, (len(tickets), len(JOINTS), 1))
    observed = np.zeros((len(tickets), len(JOINTS)), np.bool_)
    after: npt.NDArray[np.float64] | None = None
    for source, rows in by_source.items():
        joints, seen = _stacked([pose for row in rows if (pose := tickets[row].pose) is not None])
        if isinstance(source.skeleton, Landmarks):
            after = hinges.copy() if after is None else after
            rotations[rows], observed[rows], after[rows] = local_from_positions(
                source.skeleton, joints, seen, after[rows]
            )
        else:
            rotations[rows], observed[rows] = adapt(source.skeleton, joints, seen, axes=source.axes)
    return Came(Poses(rotations, observed), None if len(posed) == len(tickets) else np.array(posed, np.intp), after)


def _stacked(poses: Sequence[Pose]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Poses of one source together: joints [row, joint, 3 or 4], observed [row, joint]."""
    block = poses[0].block
    if block is not None:
        places = [pose.row for pose in poses if pose.block is block]
        if len(places) == len(poses):  # as most of a turn's are
            if places == [*range(len(block.joints))]:
                return block.joints, block.observed
            return block.joints[places], block.observed[places]
    return np.stack([pose.joints for pose in poses]), np.stack([pose.observed for pose in poses])


def reject_jumps(
    new: Poses, old: Poses, jumps: npt.NDArray[np.int64], noisy: npt.NDArray[np.bool_]
) -> tuple[Poses, npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Take joints that flipped as untracked.

    Args:
        new: poses that came.
        old: poses before them.
        jumps: [row, joint] frames rejected in a row so far.
        noisy: [row] whether the source flips at all.

    Returns:
        the poses with flipped joints unobserved, the new counts, and which joints [row, joint] were rejected.
    """
    comparable = noisy[:, None] & new.observed & (old.observed | (jumps > 0))
    near = np.abs(dot(old.rotations, new.rotations)) > _SURELY_NEAR  # that's sooner known than the angle
    if not (comparable & ~near).any():
        return new, np.where(new.observed, 0, jumps), np.zeros(jumps.shape, np.bool_)
    far = comparable & (angle_between(old.rotations, new.rotations) > JUMP_RAD)
    rejected = far & (jumps + 1 < JUMPS_BELIEVED)
    counts = np.where(rejected, jumps + 1, np.where(new.observed, 0, jumps))
    return Poses(new.rotations, new.observed & ~rejected), counts, rejected


def hold(new: Poses, old: Poses) -> Poses:
    """Unobserved joints keep the rotation they had."""
    if new.observed.all():
        return new
    return Poses(np.where(new.observed[..., None], new.rotations, old.rotations), new.observed)


def on_the_way(
    old: Poses, new: Poses, fraction: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """`between` where no pose has arrived yet and none is held, as is usual."""
    rotations = slerp(old.rotations, new.rotations, fraction[:, None])
    return rotations.astype(np.float32), (new.observed & old.observed).astype(np.float32)


def arrived(new: Poses) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """`between` at the poses that came, for the whole batch."""
    return new.rotations.astype(np.float32), new.observed.astype(np.float32)


def between(
    old: Poses, new: Poses, fraction: npt.NDArray[np.float64], held: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """The poses at one grid step.

    Args:
        old: the poses before, holes held.
        new: the poses that came, holes held.
        fraction: [row] 0 at old, 1 at new.
        held: [row] the old pose stays, unobserved.

    Returns:
        rotations float32 [row, joint, 4] and mask float32 [row, joint]. Between two poses a joint counts as observed
        where both show it.
    """
    rotations, mask = arrived(new)
    moving = np.flatnonzero((fraction < 1.0) & ~held)
    if len(moving):
        rotations[moving], mask[moving] = on_the_way(old.rows(moving), new.rows(moving), fraction[moving])
    rotations[held], mask[held] = old.rotations[held], 0.0
    return rotations, mask
