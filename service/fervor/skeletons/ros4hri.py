"""ROS4HRI (REP-155): the links of human_description, from TF. Zero pose N, axes X forward, Y left, Z up (REP-103).

Joint names are link names without their `_<body id>`. Local rotations are those of TF from a link's parent in this tree
to the link. The model is coarse: one waist joint (so spine is all the trunk does, and the chest is unseen), one-axis
elbows and knees, no wrists.
"""

from fervor.skeletons.binds import bind_of
from fervor.skeletons.skeleton import define
from fervor.skeletons.xsens import FORWARD_LEFT_UP

ROS4HRI = define(
    name="ros4hri",
    title="ROS4HRI human_description (11 links from TF)",
    tree={
        "body": None,
        "torso": "body",
        "head": "torso",
        "l_shoulder": "torso",
        "l_elbow": "l_shoulder",
        "r_shoulder": "torso",
        "r_elbow": "r_shoulder",
        "l_hip": "body",
        "l_knee": "l_hip",
        "r_hip": "body",
        "r_knee": "r_hip",
    },
    drives={
        "pelvis": "body",
        "abdomen": "torso",
        "thorax": "torso",
        "head": "head",
        "l_uparm": "l_shoulder",
        "l_forearm": "l_elbow",
        "r_uparm": "r_shoulder",
        "r_forearm": "r_elbow",
        "l_thigh": "l_hip",
        "l_shank": "l_knee",
        "r_thigh": "r_hip",
        "r_shank": "r_knee",
    },
    bind=bind_of(FORWARD_LEFT_UP, {}),
)
