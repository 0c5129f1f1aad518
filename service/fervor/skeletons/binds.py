"""Bind alignments that many sources share (formula 3): A_j = T_j^-1 · C · B_j.

T_j is a segment's canonical orientation in the source's reference pose: the identity in an N-pose; in a T-pose a
quarter turn about Z for the arms, left up to +X, right up to -X. C turns the source's axes into left, up, forward.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fervor.rotations import IDENTITY, conjugate, multiply, normalise
from fervor.skeletons.rig import SEGMENTS

Quaternion = npt.NDArray[np.float64]

LEFT_ARM = ("l_uparm", "l_forearm", "l_hand")
RIGHT_ARM = ("r_uparm", "r_forearm", "r_hand")


def wxyz(w: float, x: float, y: float, z: float) -> Quaternion:
    """A quaternion as the tables print it, w first; need not be of unit length."""
    return normalise(np.array([x, y, z, w], np.float64))


T_POSE: Mapping[str, Quaternion] = {
    **dict.fromkeys(LEFT_ARM, wxyz(1, 0, 0, 1)),
    **dict.fromkeys(RIGHT_ARM, wxyz(1, 0, 0, -1)),
}
"""T_j of the segments that a T-pose turns: Rz(+90°) on the left, Rz(-90°) on the right."""


def bind_of(axes: Quaternion, pose: Mapping[str, Quaternion]) -> dict[str, Quaternion]:
    """A_j of every segment of a source whose rotations are all the identity in its reference pose.

    Args:
        axes: C [4], from the source's axes to left, up, forward.
        pose: T_j [4] of the segments that the reference pose turns: `T_POSE`, or {} for an N-pose.
    """
    return {segment: multiply(conjugate(pose.get(segment, IDENTITY)), axes) for segment in SEGMENTS}
