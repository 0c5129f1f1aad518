"""The joints of frames of many sessions, read together: one block of numbers, one check.

The plain way reads a frame by itself (`Agreement.pose_of`). Frames whose joints are raw float32 are read in blocks of
one layout; each pose is the same, to the bit. What a block finds wrong is read again in the plain way, which says what.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fervor.errors import FrameError
from fervor.protocol.lean_frame import LeanFrame
from fervor.protocol.messages import Frame
from fervor.protocol.poses import NOT_UNIT_ABOVE, UNTRACKED_BELOW
from fervor.session.events import Block, Pose
from fervor.session.start import Agreement, Layout

Read = Pose | FrameError
"""A frame's pose, or why it has none."""


def read_poses(frames: Sequence[tuple[Agreement, LeanFrame | Frame]]) -> list[Read]:
    """The pose of each frame, as its session's agreement has it, or the error of a poisoned one."""
    read: list[Read | None] = [None] * len(frames)
    blocks: dict[Layout, list[int]] = {}
    for place, (agreement, frame) in enumerate(frames):
        layout = agreement.layout
        if layout is not None and isinstance(frame, LeanFrame) and len(frame.q) == layout.size:
            blocks.setdefault(layout, []).append(place)
    for layout, places in blocks.items():
        joints = b"".join([frames[place][1].q for place in places])  # type: ignore[misc]  # raw frames, as above
        for place, pose in zip(places, _read_block(layout, joints), strict=True):
            read[place] = pose
    return [pose or _plainly(*frames[place]) for place, pose in enumerate(read)]


def _read_block(layout: Layout, raw: bytes) -> list[Pose | None]:
    """The poses of frames of one layout, from their joints one after the other; None where something is wrong."""
    joints = np.frombuffer(raw, "<f4").reshape(-1, layout.joints, 4).astype(np.float64)  # [frame, joint, 4]
    lengths = np.sqrt(np.add.reduce(joints * joints, axis=-1))  # of float32, so that none overflows
    right = (lengths <= NOT_UNIT_ABOVE).all(axis=-1)
    observed = lengths >= UNTRACKED_BELOW
    if layout.order == "wxyz":
        joints = np.roll(joints, -1, axis=-1)
    if layout.places is not None:
        joints, observed = _arranged(layout.places, layout.known, joints, observed)
    block = Block(joints, observed)
    lost = np.logical_not(observed.any(axis=-1)).tolist()
    poses = enumerate(zip(joints, observed, lost, right.tolist(), strict=True))
    return [Pose(q, seen, none, block, row) if good else None for row, (q, seen, none, good) in poses]


def _arranged(
    places: npt.NDArray[np.intp], known: int, joints: npt.NDArray[np.float64], observed: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Joints that were sent at their places among all that are `known`; the others are unobserved."""
    arranged, seen = np.zeros((len(joints), known, 4)), np.zeros((len(joints), known), np.bool_)
    arranged[:, places], seen[:, places] = joints, observed
    return arranged, seen


def _plainly(agreement: Agreement, frame: LeanFrame | Frame) -> Read:
    try:
        return agreement.pose_of(frame.to_frame() if isinstance(frame, LeanFrame) else frame)
    except FrameError as error:
        return error
