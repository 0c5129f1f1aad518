"""SMPL: 24 local rotations, zero pose T, axes left-up-forward.

Axis-angle parameters become quaternions with `rotations.from_rotvec`. SMPL-H and SMPL-X start with the same 22 joints:
send those with `joints`.
"""

from fervor.rotations import IDENTITY
from fervor.skeletons.binds import T_POSE, bind_of
from fervor.skeletons.skeleton import define

SMPL = define(
    name="smpl",
    title="SMPL (24 joints)",
    tree={
        "pelvis": None,
        "l_hip": "pelvis",
        "r_hip": "pelvis",
        "spine1": "pelvis",
        "l_knee": "l_hip",
        "r_knee": "r_hip",
        "spine2": "spine1",
        "l_ankle": "l_knee",
        "r_ankle": "r_knee",
        "spine3": "spine2",
        "l_foot": "l_ankle",
        "r_foot": "r_ankle",
        "neck": "spine3",
        "l_collar": "spine3",
        "r_collar": "spine3",
        "head": "neck",
        "l_shoulder": "l_collar",
        "r_shoulder": "r_collar",
        "l_elbow": "l_shoulder",
        "r_elbow": "r_shoulder",
        "l_wrist": "l_elbow",
        "r_wrist": "r_elbow",
        "l_hand": "l_wrist",
        "r_hand": "r_wrist",
    },
    drives={
        "pelvis": "pelvis",
        "abdomen": "spine1",
        "thorax": "spine3",
        "head": "head",
        "l_uparm": "l_shoulder",
        "l_forearm": "l_elbow",
        "l_hand": "l_wrist",
        "r_uparm": "r_shoulder",
        "r_forearm": "r_elbow",
        "r_hand": "r_wrist",
        "l_thigh": "l_hip",
        "l_shank": "l_knee",
        "r_thigh": "r_hip",
        "r_shank": "r_knee",
    },
    bind=bind_of(IDENTITY, T_POSE),
)
