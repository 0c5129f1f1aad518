"""C13, the canonical rig: 13 local joint rotations, root excluded, that every sensor is adapted to.

Body frame, right-handed: X left, Y up, Z forward. Reference pose is the N-pose (standing, arms hanging, palms to the
thighs): there every local rotation is the identity. A joint is the rotation of its child segment relative to its
parent segment, so neither body size nor the sensor's place can enter (Sun et al., section III-A).
"""

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from fervor.rotations import mirror

F = TypeVar("F", bound=np.floating[Any])

SEGMENTS: tuple[str, ...] = (
    "pelvis",
    "abdomen",
    "thorax",
    "head",
    "l_uparm",
    "l_forearm",
    "l_hand",
    "r_uparm",
    "r_forearm",
    "r_hand",
    "l_thigh",
    "l_shank",
    "r_thigh",
    "r_shank",
)
"""The 14 rigid parts that the 13 joints connect; the pelvis is the root."""

JOINTS: tuple[str, ...] = (
    "spine",
    "chest",
    "head",
    "l_shoulder",
    "l_elbow",
    "l_wrist",
    "r_shoulder",
    "r_elbow",
    "r_wrist",
    "l_hip",
    "l_knee",
    "r_hip",
    "r_knee",
)
"""Order of the joint axis of every canonical pose: [..., 13, 4]."""

PARENTS: tuple[int, ...] = (-1, 0, 1, 1, 3, 4, 1, 6, 7, -1, 9, -1, 11)
"""Parent joint of each joint; -1 is the pelvis."""

MIRROR: tuple[int, ...] = (0, 1, 2, 6, 7, 8, 3, 4, 5, 11, 12, 9, 10)
"""The joint on the other side of the body; midline joints are their own."""

PARENT_SEGMENT: tuple[int, ...] = (0, 1, 2, 2, 4, 5, 2, 7, 8, 0, 10, 0, 12)
"""Segment above each joint."""

CHILD_SEGMENT: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)
"""Segment below each joint."""

UPPER_BODY: tuple[int, ...] = tuple(range(9))
"""Joints that carry the label: EBMDB's raters saw an upper body, its actors sat."""


def mirror_pose(local: npt.NDArray[F], observed: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[F], npt.NDArray[np.bool_]]:
    """Poses [..., 13, 4] with their mask [..., 13] as a mirror shows them: left and right swapped (formula 6)."""
    swap = list(MIRROR)
    return mirror(local[..., swap, :]), observed[..., swap]
