"""From the poses of a batch of tickets to what the model eats, step by step. Pure functions on arrays.

Elementwise throughout: no row can depend on its neighbours in the batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, angle_between, slerp
from fervor.session.events import Source, Ticket
from fervor.skeletons.adapter import adapt
from fervor.skeletons.landmarks import Landmarks
from fervor.skeletons.positions import local_from_positions
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.skeleton import Skeleton

JUMP_RAD = np.radians(120.0)
"""A noisy sensor's joint that turns further than this in one frame has flipped, not moved."""

JUMPS_BELIEVED = 5
"""A rotation that was rejected this often in a row is believed: the sensor settled there."""


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Canonical poses of a batch."""

    rotations: npt.NDArray[np.float64]  # [row, joint, 4] xyzw
    observed: npt.NDArray[np.bool_]  # [row, joint]

    def rows(self, which: npt.NDArray[Any]) -> "Poses":
        """Some of them, by number or by mask."""
        return Poses(self.rotations[which], self.observed[which])


def adapt_all(
    tickets: Sequence[Ticket], hinges: npt.NDArray[np.float64], slots: npt.NDArray[np.intp]
) -> tuple[Poses, npt.NDArray[np.float64] | None]:
    """The tickets' poses in the rig C13; tickets of one source are adapted in one go.

    Args:
        tickets: the batch.
        hinges: [slot, limb, bone, 3] what landmark sensors remember of each body's limbs.
        slots: [row] of the tickets.

    Returns:
        the poses, and the hinges [row, limb, bone, 3] after them; None where nobody has such a sensor.
    """
    by_source: dict[Source, list[int]] = {}
    for row, ticket in enumerate(tickets):
        if ticket.pose is not None:
            by_source.setdefault(ticket.source, []).append(row)
    if len(by_source) == 1:
        ((source, rows),) = by_source.items()
        if len(rows) == len(tickets) and isinstance(source.skeleton, Skeleton):
            return Poses(*adapt(source.skeleton, *_stacked(tickets, rows), axes=source.axes)), None
    rotations = np.tile(IDENTITY, (len(tickets), len(JOINTS), 1))
    observed = np.zeros((len(tickets), len(JOINTS)), np.bool_)
    after: npt.NDArray[np.float64] | None = None
    for source, rows in by_source.items():
        joints, seen = _stacked(tickets, rows)
        if isinstance(source.skeleton, Landmarks):
            after = hinges[slots] if after is None else after
            rotations[rows], observed[rows], after[rows] = local_from_positions(
                source.skeleton, joints, seen, after[rows]
            )
        else:
            rotations[rows], observed[rows] = adapt(source.skeleton, joints, seen, axes=source.axes)
    return Poses(rotations, observed), after


def _stacked(tickets: Sequence[Ticket], rows: Sequence[int]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """The poses of these tickets: joints [row, joint, 3 or 4], observed [row, joint]."""
    poses = [pose for row in rows if (pose := tickets[row].pose) is not None]
    block = poses[0].block
    if block is not None and all(pose.block is block for pose in poses):  # as most of a turn's are
        places = [pose.row for pose in poses]
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
    if not noisy.any():
        return new, np.where(new.observed, 0, jumps), np.zeros(jumps.shape, np.bool_)
    comparable = new.observed & old.observed | new.observed & (jumps > 0)
    far = noisy[:, None] & comparable & (angle_between(old.rotations, new.rotations) > JUMP_RAD)
    rejected = far & (jumps + 1 < JUMPS_BELIEVED)
    counts = np.where(rejected, jumps + 1, np.where(new.observed, 0, jumps))
    return Poses(new.rotations, new.observed & ~rejected), counts, rejected


def hold(new: Poses, old: Poses) -> Poses:
    """Unobserved joints keep the rotation they had."""
    if new.observed.all():
        return new
    return Poses(np.where(new.observed[..., None], new.rotations, old.rotations), new.observed)


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
    arrived = fraction >= 1.0
    if arrived.all() and not held.any():  # as of a sensor that keeps the grid's time
        return new.rotations.astype(np.float32), new.observed.astype(np.float32)
    rotations, observed = new.rotations.astype(np.float32), new.observed.copy()
    on_the_way = np.flatnonzero(~arrived & ~held)
    if len(on_the_way):
        before, after = old.rows(on_the_way), new.rows(on_the_way)
        share = np.broadcast_to(fraction[on_the_way, None], after.observed.shape)
        rotations[on_the_way] = slerp(before.rotations, after.rotations, share)
        observed[on_the_way] &= before.observed
    rotations[held], observed[held] = old.rotations[held], False
    return rotations, observed.astype(np.float32)
