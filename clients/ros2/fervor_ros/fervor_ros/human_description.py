"""The human of REP-155: the angles of its URDF joints become local rotations of the skeleton `ros4hri`.

Rules. A joint turns its child link by its angle about a fixed axis of its parent link (URDF, `revolute`); all origins
are turned by nothing, so the rotation from one link to another is the product of the joints between them, the parent's
first. Axes are those of the package `human_description`, REP-103: x forward, y left, z up; at zero the arms hang. Its
names mislead: `p_shoulder` and `p_hip` lift a limb sideways (about x), `r_hip` swings the thigh (about y). A link with
a joint that has no angle is untracked.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.rotations import from_axis_angle, identity, multiply
from fervor.skeletons.ros4hri import ROS4HRI

Axis = tuple[float, float, float]

AXES: Mapping[str, Axis] = {
    "waist": (0, 1, 0),
    "r_head": (1, 0, 0),
    "y_head": (0, 0, 1),
    "p_head": (0, -1, 0),
    "l_y_shoulder": (0, 0, -1),
    "l_p_shoulder": (1, 0, 0),
    "l_r_shoulder": (0, 0, 1),
    "l_elbow": (0, -1, 0),
    "r_y_shoulder": (0, 0, 1),
    "r_p_shoulder": (-1, 0, 0),
    "r_r_shoulder": (0, 0, -1),
    "r_elbow": (0, -1, 0),
    "l_y_hip": (0, 0, -1),
    "l_p_hip": (1, 0, 0),
    "l_r_hip": (0, -1, 0),
    "l_knee": (0, -1, 0),
    "r_y_hip": (0, 0, -1),
    "r_p_hip": (-1, 0, 0),
    "r_r_hip": (0, -1, 0),
    "r_knee": (0, -1, 0),
}
"""What each joint turns about, in its parent link. `y_hip` is not mirrored, in the URDF neither."""

CHAINS: Mapping[str, tuple[str, ...]] = {
    "torso": ("waist",),
    "head": ("r_head", "y_head", "p_head"),
    "l_shoulder": ("l_y_shoulder", "l_p_shoulder", "l_r_shoulder"),
    "l_elbow": ("l_elbow",),
    "r_shoulder": ("r_y_shoulder", "r_p_shoulder", "r_r_shoulder"),
    "r_elbow": ("r_elbow",),
    "l_hip": ("l_y_hip", "l_p_hip", "l_r_hip"),
    "l_knee": ("l_knee",),
    "r_hip": ("r_y_hip", "r_p_hip", "r_r_hip"),
    "r_knee": ("r_knee",),
}
"""The joints from a link's parent in the skeleton to the link, in order. The root `body` has none."""

_INDEX = {joint: index for index, joint in enumerate(AXES)}
_AXES = np.array(list(AXES.values()), np.float64)  # [joint, 3]
_DEEPEST = max(len(chain) for chain in CHAINS.values())
_STEPS = np.full((_DEEPEST, len(ROS4HRI.joints)), len(AXES), np.intp)  # [step, link]; past the last joint: no turn
for _link, _chain in CHAINS.items():
    _STEPS[: len(_chain), ROS4HRI.joints.index(_link)] = [_INDEX[joint] for joint in _chain]


def link_rotations(names: Iterable[str], positions: Iterable[float], *, body: str = "") -> npt.NDArray[np.float64]:
    """Local rotations of the links from joint angles as `sensor_msgs/JointState` has them.

    Args:
        names: joints, with or without the `_<body>` that REP-155 appends; others than `AXES` are passed over.
        positions: their angles, radians; not finite where unknown.
        body: the id.

    Returns:
        [link, 4] xyzw in the order of `ROS4HRI.joints`; NaN where untracked.
    """
    angles = np.full(len(AXES), np.nan)  # [joint]
    suffix = f"_{body}"
    for name, angle in zip(names, positions, strict=False):
        index = _INDEX.get(name.removesuffix(suffix))
        if index is not None and np.isfinite(angle):
            angles[index] = angle
    turns: npt.NDArray[Any] = identity((len(AXES) + 1,))  # [joint + 1, 4]
    turns[:-1] = from_axis_angle(_AXES, angles)
    rotations: npt.NDArray[np.float64] = turns[_STEPS[0]]
    for step in _STEPS[1:]:
        rotations = multiply(rotations, turns[step])
    return rotations
