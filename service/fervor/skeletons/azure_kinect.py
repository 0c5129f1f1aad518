"""Azure Kinect body tracking: absolute orientations in depth-camera axes, w first, driving the bone that starts there.

Camera axes: X right (a facing person's left), Y down, Z away. Left and right joints have flipped axes on purpose; the
alignments are those of Microsoft's sample (TrackerHandler's basis per joint).
"""

from fervor.skeletons.binds import wxyz
from fervor.skeletons.skeleton import define

_TRUNK_AND_LEFT_LEG = wxyz(1, 1, 1, 1)
_RIGHT_LEG = wxyz(1, -1, 1, -1)

AZURE_KINECT = define(
    name="azure_kinect",
    title="Azure Kinect (32 joints)",
    tree={
        "PELVIS": None,
        "SPINE_NAVEL": "PELVIS",
        "SPINE_CHEST": "SPINE_NAVEL",
        "NECK": "SPINE_CHEST",
        "CLAVICLE_LEFT": "SPINE_CHEST",
        "SHOULDER_LEFT": "CLAVICLE_LEFT",
        "ELBOW_LEFT": "SHOULDER_LEFT",
        "WRIST_LEFT": "ELBOW_LEFT",
        "HAND_LEFT": "WRIST_LEFT",
        "HANDTIP_LEFT": "HAND_LEFT",
        "THUMB_LEFT": "WRIST_LEFT",
        "CLAVICLE_RIGHT": "SPINE_CHEST",
        "SHOULDER_RIGHT": "CLAVICLE_RIGHT",
        "ELBOW_RIGHT": "SHOULDER_RIGHT",
        "WRIST_RIGHT": "ELBOW_RIGHT",
        "HAND_RIGHT": "WRIST_RIGHT",
        "HANDTIP_RIGHT": "HAND_RIGHT",
        "THUMB_RIGHT": "WRIST_RIGHT",
        "HIP_LEFT": "PELVIS",
        "KNEE_LEFT": "HIP_LEFT",
        "ANKLE_LEFT": "KNEE_LEFT",
        "FOOT_LEFT": "ANKLE_LEFT",
        "HIP_RIGHT": "PELVIS",
        "KNEE_RIGHT": "HIP_RIGHT",
        "ANKLE_RIGHT": "KNEE_RIGHT",
        "FOOT_RIGHT": "ANKLE_RIGHT",
        "HEAD": "NECK",
        "NOSE": "HEAD",
        "EYE_LEFT": "HEAD",
        "EAR_LEFT": "HEAD",
        "EYE_RIGHT": "HEAD",
        "EAR_RIGHT": "HEAD",
    },
    drives={
        "pelvis": "PELVIS",
        "abdomen": "SPINE_NAVEL",
        "thorax": "SPINE_CHEST",
        "head": "HEAD",
        "l_uparm": "SHOULDER_LEFT",
        "l_forearm": "ELBOW_LEFT",
        "l_hand": "WRIST_LEFT",
        "r_uparm": "SHOULDER_RIGHT",
        "r_forearm": "ELBOW_RIGHT",
        "r_hand": "WRIST_RIGHT",
        "l_thigh": "HIP_LEFT",
        "l_shank": "KNEE_LEFT",
        "r_thigh": "HIP_RIGHT",
        "r_shank": "KNEE_RIGHT",
    },
    bind={
        **dict.fromkeys(("pelvis", "abdomen", "thorax", "head", "l_thigh", "l_shank"), _TRUNK_AND_LEFT_LEG),
        **dict.fromkeys(("r_thigh", "r_shank"), _RIGHT_LEG),
        **dict.fromkeys(("l_uparm", "l_forearm"), wxyz(1, 1, -1, -1)),
        **dict.fromkeys(("r_uparm", "r_forearm"), wxyz(1, -1, -1, 1)),
        "l_hand": wxyz(1, 0, 0, -1),
        "r_hand": wxyz(0, 1, 1, 0),
    },
    axes="global",
    quaternion="wxyz",
    noisy=True,
)
