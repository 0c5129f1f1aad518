"""Xsens MVN: 23 segments with absolute orientations, w first, in axes forward, left, up.

In MVN's T-pose every segment's orientation is the heading alone, so with a heading of zero A_j = T_j^-1 · C. An MVNX
file brings its own T-pose, which `recordings.mvnx` uses instead. Clavicles ("Shoulder" segments) are modelled by MVN,
not measured; they only matter for local rotations, where the upper arm's path passes them.
"""

from fervor.skeletons.binds import T_POSE, bind_of, wxyz
from fervor.skeletons.skeleton import define

FORWARD_LEFT_UP = wxyz(0.5, -0.5, -0.5, -0.5)
"""C from axes X forward, Y left, Z up (MVN, ROS) to left, up, forward: (w, x, y, z) becomes (w, y, z, x)."""

XSENS_MVN = define(
    name="xsens_mvn",
    title="Xsens MVN (23 segments)",
    tree={
        "Pelvis": None,
        "L5": "Pelvis",
        "L3": "L5",
        "T12": "L3",
        "T8": "T12",
        "Neck": "T8",
        "Head": "Neck",
        "RightShoulder": "T8",
        "RightUpperArm": "RightShoulder",
        "RightForeArm": "RightUpperArm",
        "RightHand": "RightForeArm",
        "LeftShoulder": "T8",
        "LeftUpperArm": "LeftShoulder",
        "LeftForeArm": "LeftUpperArm",
        "LeftHand": "LeftForeArm",
        "RightUpperLeg": "Pelvis",
        "RightLowerLeg": "RightUpperLeg",
        "RightFoot": "RightLowerLeg",
        "RightToe": "RightFoot",
        "LeftUpperLeg": "Pelvis",
        "LeftLowerLeg": "LeftUpperLeg",
        "LeftFoot": "LeftLowerLeg",
        "LeftToe": "LeftFoot",
    },
    drives={
        "pelvis": "Pelvis",
        "abdomen": "L3",
        "thorax": "T8",
        "head": "Head",
        "l_uparm": "LeftUpperArm",
        "l_forearm": "LeftForeArm",
        "l_hand": "LeftHand",
        "r_uparm": "RightUpperArm",
        "r_forearm": "RightForeArm",
        "r_hand": "RightHand",
        "l_thigh": "LeftUpperLeg",
        "l_shank": "LeftLowerLeg",
        "r_thigh": "RightUpperLeg",
        "r_shank": "RightLowerLeg",
    },
    bind=bind_of(FORWARD_LEFT_UP, T_POSE),
    axes="global",
    quaternion="wxyz",
)
