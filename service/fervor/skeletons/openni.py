"""OpenNI with NiTE, and Nuitrack: absolute orientations, the identity in a T-pose facing the sensor.

Axes are expected right-handed: X to a facing person's right, Y up, Z away from the sensor, as openni_tracker publishes
them before it changes to the camera's frame. OpenNI itself has X the other way, which is left-handed: quaternions of
its matrices become these by `rotations.mirror`, (x, -y, -z, w). Drivers differ, so confirm with a calibration. Neither
sees hands turn; NiTE has no waist, so spine, chest and hips are unseen; Nuitrack has one joint between waist and
collars, so the chest is unseen.
"""

from fervor.skeletons.binds import T_POSE, bind_of, wxyz
from fervor.skeletons.skeleton import define

_FACING_THE_SENSOR = wxyz(0, 0, 1, 0)
"""C = diag(-1, 1, -1)."""

NITE = define(
    name="nite",
    title="OpenNI with NiTE (15 joints)",
    tree={
        "HEAD": "NECK",
        "NECK": "TORSO",
        "LEFT_SHOULDER": "NECK",
        "RIGHT_SHOULDER": "NECK",
        "LEFT_ELBOW": "LEFT_SHOULDER",
        "RIGHT_ELBOW": "RIGHT_SHOULDER",
        "LEFT_HAND": "LEFT_ELBOW",
        "RIGHT_HAND": "RIGHT_ELBOW",
        "TORSO": None,
        "LEFT_HIP": "TORSO",
        "RIGHT_HIP": "TORSO",
        "LEFT_KNEE": "LEFT_HIP",
        "RIGHT_KNEE": "RIGHT_HIP",
        "LEFT_FOOT": "LEFT_KNEE",
        "RIGHT_FOOT": "RIGHT_KNEE",
    },
    drives={
        "thorax": "TORSO",
        "head": "HEAD",
        "l_uparm": "LEFT_SHOULDER",
        "l_forearm": "LEFT_ELBOW",
        "r_uparm": "RIGHT_SHOULDER",
        "r_forearm": "RIGHT_ELBOW",
        "l_thigh": "LEFT_HIP",
        "l_shank": "LEFT_KNEE",
        "r_thigh": "RIGHT_HIP",
        "r_shank": "RIGHT_KNEE",
    },
    bind=bind_of(_FACING_THE_SENSOR, T_POSE),
    axes="global",
    noisy=True,
)

NUITRACK = define(
    name="nuitrack",
    title="Nuitrack (24 joints)",
    tree={
        "HEAD": "NECK",
        "NECK": "LEFT_COLLAR",
        "TORSO": "WAIST",
        "WAIST": None,
        "LEFT_COLLAR": "TORSO",
        "LEFT_SHOULDER": "LEFT_COLLAR",
        "LEFT_ELBOW": "LEFT_SHOULDER",
        "LEFT_WRIST": "LEFT_ELBOW",
        "LEFT_HAND": "LEFT_WRIST",
        "LEFT_FINGERTIP": "LEFT_HAND",
        "RIGHT_COLLAR": "TORSO",
        "RIGHT_SHOULDER": "RIGHT_COLLAR",
        "RIGHT_ELBOW": "RIGHT_SHOULDER",
        "RIGHT_WRIST": "RIGHT_ELBOW",
        "RIGHT_HAND": "RIGHT_WRIST",
        "RIGHT_FINGERTIP": "RIGHT_HAND",
        "LEFT_HIP": "WAIST",
        "LEFT_KNEE": "LEFT_HIP",
        "LEFT_ANKLE": "LEFT_KNEE",
        "LEFT_FOOT": "LEFT_ANKLE",
        "RIGHT_HIP": "WAIST",
        "RIGHT_KNEE": "RIGHT_HIP",
        "RIGHT_ANKLE": "RIGHT_KNEE",
        "RIGHT_FOOT": "RIGHT_ANKLE",
    },
    drives={
        "pelvis": "WAIST",
        "abdomen": "TORSO",
        "thorax": "TORSO",
        "head": "HEAD",
        "l_uparm": "LEFT_SHOULDER",
        "l_forearm": "LEFT_ELBOW",
        "r_uparm": "RIGHT_SHOULDER",
        "r_forearm": "RIGHT_ELBOW",
        "l_thigh": "LEFT_HIP",
        "l_shank": "LEFT_KNEE",
        "r_thigh": "RIGHT_HIP",
        "r_shank": "RIGHT_KNEE",
    },
    bind=bind_of(_FACING_THE_SENSOR, T_POSE),
    axes="global",
    noisy=True,
)
