"""The joints of frames of many sessions, read together: one block of numbers, one check.

The plain way reads a frame by itself (`Agreement.pose_of`). Here frames are read in blocks of one layout; each pose is
the same, to the bit. A frame that is not surely right is read again in the plain way, which says what is wrong.
"""

from collections.abc import Iterable, Sequence
from itertools import repeat

import numpy as np

from fervor.errors import FrameError
from fervor.protocol.lean_frame import LeanFrame
from fervor.session.events import Block, Pose
from fervor.session.start import Agreement, Layout

Read = Pose | FrameError
"""A frame's pose, or why it has none."""


def read_poses(frames: Sequence[tuple[Agreement, LeanFrame]]) -> list[Read]:
    """The pose of each frame, as its session's agreement has it, or the error of a poisoned one."""
    by_layout: dict[Layout, list[int]] = {}
    for place, (agreement, _) in enumerate(frames):
        by_layout.setdefault(agreement.layout, []).append(place)
    read: list[Pose | None] = [None] * len(frames)
    for layout, places in by_layout.items():
        poses = _read_block(layout, [frames[place][1] for place in places])
        if len(by_layout) == 1:
            read = poses
            break
        for place, pose in zip(places, poses, strict=True):
            read[place] = pose
    return [_plainly(*frames[place]) if pose is None else pose for place, pose in enumerate(read)]


def _read_block(layout: Layout, frames: Sequence[LeanFrame]) -> list[Pose | None]:
    """The poses of frames of one layout; None where one is not surely right."""
    read = layout.read(frames)
    lost: Iterable[bool] = repeat(False)  # noqa: FBT003  # what is repeated, no switch
    if np.count_nonzero(read.observed) < read.observed.size:
        lost = np.logical_not(read.observed.any(axis=-1)).tolist()
    block = Block(read.joints, read.observed)
    poses: list[Pose | None] = list(map(Pose, block.joints, block.observed, lost, repeat(block), range(len(frames))))
    for row in read.doubtful:
        poses[row] = None
    return poses


def _plainly(agreement: Agreement, frame: LeanFrame) -> Read:
    try:
        return agreement.pose_of(frame.to_message())
    except FrameError as error:
        return error
