"""Kinect v2 and Kinect v1: absolute orientations in camera axes, stored at the joint where the bone ends.

Camera axes: X to the sensor's left (a facing person's right), Y up, Z away from the sensor. A bone's own axes: Y along
the bone, Z its normal, X its binormal. Leaf joints (head, hand tips, thumbs, feet) carry zero quaternions, so the neck
stands for the head. The roll of forearms and hands is noisy and can flip by 180°. The alignments follow an open
converter and Microsoft's description of the bones; the roll of legs and forearms was never confirmed on hardware, nor
were v1's, which are taken as v2's: a calibration settles it for a sensor at hand.
"""

from collections.abc import Mapping

from fervor.skeletons.binds import Quaternion, wxyz
from fervor.skeletons.skeleton import define

BINDS: Mapping[str, Quaternion] = {
    **dict.fromkeys(("l_uparm", "l_forearm", "l_hand", "r_uparm", "r_forearm", "r_hand"), wxyz(0, 0, 0, 1)),
    **dict.fromkeys(("l_thigh", "l_shank"), wxyz(0, 1, 0, 1)),
    **dict.fromkeys(("r_thigh", "r_shank"), wxyz(0, 1, 0, -1)),
}
"""A_j where it isn't the identity."""

_LIMBS = {
    "l_uparm": "ElbowLeft",
    "l_forearm": "WristLeft",
    "l_hand": "HandLeft",
    "r_uparm": "ElbowRight",
    "r_forearm": "WristRight",
    "r_hand": "HandRight",
    "l_thigh": "KneeLeft",
    "l_shank": "AnkleLeft",
    "r_thigh": "KneeRight",
    "r_shank": "AnkleRight",
}

KINECT_V2 = define(
    name="kinect_v2",
    title="Kinect v2 (25 joints)",
    tree={
        "SpineBase": None,
        "SpineMid": "SpineBase",
        "Neck": "SpineShoulder",
        "Head": "Neck",
        "ShoulderLeft": "SpineShoulder",
        "ElbowLeft": "ShoulderLeft",
        "WristLeft": "ElbowLeft",
        "HandLeft": "WristLeft",
        "ShoulderRight": "SpineShoulder",
        "ElbowRight": "ShoulderRight",
        "WristRight": "ElbowRight",
        "HandRight": "WristRight",
        "HipLeft": "SpineBase",
        "KneeLeft": "HipLeft",
        "AnkleLeft": "KneeLeft",
        "FootLeft": "AnkleLeft",
        "HipRight": "SpineBase",
        "KneeRight": "HipRight",
        "AnkleRight": "KneeRight",
        "FootRight": "AnkleRight",
        "SpineShoulder": "SpineMid",
        "HandTipLeft": "HandLeft",
        "ThumbLeft": "WristLeft",
        "HandTipRight": "HandRight",
        "ThumbRight": "WristRight",
    },
    drives={"pelvis": "SpineBase", "abdomen": "SpineMid", "thorax": "SpineShoulder", "head": "Neck", **_LIMBS},
    bind=BINDS,
    axes="global",
    noisy=True,
)

KINECT_V1 = define(
    name="kinect_v1",
    title="Kinect v1, SDK 1.5 to 1.8 (20 joints, BoneOrientations by end joint)",
    tree={
        "HipCenter": None,
        "Spine": "HipCenter",
        "ShoulderCenter": "Spine",
        "Head": "ShoulderCenter",
        "ShoulderLeft": "ShoulderCenter",
        "ElbowLeft": "ShoulderLeft",
        "WristLeft": "ElbowLeft",
        "HandLeft": "WristLeft",
        "ShoulderRight": "ShoulderCenter",
        "ElbowRight": "ShoulderRight",
        "WristRight": "ElbowRight",
        "HandRight": "WristRight",
        "HipLeft": "HipCenter",
        "KneeLeft": "HipLeft",
        "AnkleLeft": "KneeLeft",
        "FootLeft": "AnkleLeft",
        "HipRight": "HipCenter",
        "KneeRight": "HipRight",
        "AnkleRight": "KneeRight",
        "FootRight": "AnkleRight",
    },
    drives={"pelvis": "HipCenter", "abdomen": "Spine", "thorax": "ShoulderCenter", "head": "Head", **_LIMBS},
    bind=BINDS,
    axes="global",
    noisy=True,
)
