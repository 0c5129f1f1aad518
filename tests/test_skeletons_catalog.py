"""One motion, rendered as every sensor of the catalogue would report it, comes back as the same motion.

The renderer knows nothing of the alignments A_j: it is built from what the sensors' documentation says, the direction
of each joint's axes while a person stands in a T-pose (or N-pose), and from where the camera is.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.adapter import adapt
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.skeleton import ROOT, Skeleton

Array = npt.NDArray[np.float64]
TURN_T = {"l": Rotation.from_euler("z", 90, degrees=True), "r": Rotation.from_euler("z", -90, degrees=True)}
DIRECTIONS = {"L": [1, 0, 0], "U": [0, 1, 0], "F": [0, 0, 1]}


def axes(text: str) -> Rotation:
    """Joint axes x, y, z as directions of the body: "-U +L +F"."""
    columns = [np.array(DIRECTIONS[word[1]]) * (1 if word[0] == "+" else -1) for word in text.split()]
    return Rotation.from_matrix(np.stack(columns, axis=1))


def per_segment(**groups: str) -> dict[str, Rotation]:
    """Joint axes of all segments from those of groups of segments."""
    table = {}
    for segment in SEGMENTS:
        side, _, part = segment.rpartition("_")
        kind = part if side else "trunk"
        group = {"uparm": "arm", "forearm": "arm", "thigh": "leg", "shank": "leg"}.get(kind, kind)
        name = f"{side}_{group}" if side else "trunk"
        table[segment] = axes(groups.get(name, groups.get(f"{side}_arm", "") if group == "hand" else ""))
    return table


BODY = "+L +U +F"
ROS = "+F +L +U"
T_POSE_AXES: Mapping[str, dict[str, Rotation]] = {
    "kinect_v2": per_segment(
        trunk=BODY, l_arm="-U +L +F", r_arm="+U -L +F", l_leg="+F -U +L", r_leg="-F -U -L"
    ),
    "azure_kinect": per_segment(
        trunk="+U +F +L", l_leg="+U +F +L", r_leg="-U -F +L", l_arm="+L +F -U", r_arm="+L -F +U",
        l_hand="+L +U +F", r_hand="+L -U -F",
    ),
    "xsens_mvn": per_segment(trunk=ROS, l_arm=ROS, r_arm=ROS, l_leg=ROS, r_leg=ROS),
    "smpl": per_segment(trunk=BODY, l_arm=BODY, r_arm=BODY, l_leg=BODY, r_leg=BODY),
    "nite": per_segment(trunk="-L +U -F", l_arm="-L +U -F", r_arm="-L +U -F", l_leg="-L +U -F", r_leg="-L +U -F"),
}  # fmt: skip
"""Joint axes during a T-pose, from the tables of the sensors."""
T_POSE_AXES = {
    **T_POSE_AXES,
    "kinect_v1": T_POSE_AXES["kinect_v2"],
    "nuitrack": T_POSE_AXES["nite"],
    "cmu": T_POSE_AXES["smpl"],
}
N_POSE_AXES: Mapping[str, dict[str, Rotation]] = {
    "ebmdb": per_segment(trunk=BODY, l_arm=BODY, r_arm=BODY, l_leg=BODY, r_leg=BODY),
    "ros4hri": per_segment(trunk=ROS, l_arm=ROS, r_arm=ROS, l_leg=ROS, r_leg=ROS),
}
"""Joint axes during an N-pose."""

UNSEEN = {
    "nite": {"spine", "chest", "l_wrist", "r_wrist", "l_hip", "r_hip"},
    "nuitrack": {"chest", "l_wrist", "r_wrist"},
    "ros4hri": {"chest", "l_wrist", "r_wrist"},
}
RENDERED = [name for name in SKELETONS if name != "c13"]


def axes_in_n_pose(name: str) -> dict[str, Rotation]:
    if name in N_POSE_AXES:
        return N_POSE_AXES[name]
    return {
        segment: (TURN_T[segment[0]].inv() if segment.endswith(("arm", "hand")) else Rotation.identity()) * turn
        for segment, turn in T_POSE_AXES[name].items()
    }


def motion(seed: int = 0, frames: int = 12) -> Array:
    """Canonical local rotations [frame, 13, 4]."""
    return Rotation.random(frames * 13, random_state=seed).as_quat().reshape(frames, 13, 4)


def body_in_space(local: Array) -> list[Rotation]:
    """Absolute orientation of every segment in body axes, the pelvis upright."""
    whole = [Rotation.identity()] * len(SEGMENTS)
    for joint in range(13):
        whole[CHILD_SEGMENT[joint]] = whole[PARENT_SEGMENT[joint]] * Rotation.from_quat(local[joint])
    return whole


def rendered(source: Skeleton, local: Array, camera: Rotation, axes_of_rotations: str, seed: int = 0) -> Array:
    """[joint, 4]: what the sensor sends for one pose. Joints that drive no segment turn at random."""
    joint_axes = axes_in_n_pose(source.name)
    whole = body_in_space(local)
    stray = Rotation.random(len(source.joints), random_state=seed)
    sent = [stray[joint] for joint in range(len(source.joints))]
    for segment, drive in reversed(list(enumerate(source.drives))):  # where two segments share a drive, the upper one
        if drive is not None:
            sent[drive] = camera * whole[segment] * joint_axes[SEGMENTS[segment]]
    if axes_of_rotations == "global":
        return np.stack([turn.as_quat() for turn in sent])
    parents = [Rotation.identity() if parent == ROOT else sent[parent] for parent in source.parents]
    return np.stack([(above.inv() * turn).as_quat() for above, turn in zip(parents, sent, strict=True)])


@pytest.mark.parametrize("axes_of_rotations", ["local", "global"])
@pytest.mark.parametrize("name", RENDERED)
def test_one_motion_through_every_sensor(name: str, axes_of_rotations: str) -> None:
    source = skeleton(name)
    poses = motion()
    seen = np.array(source.sees)
    assert {joint for joint, here in zip(JOINTS, seen, strict=True) if not here} == UNSEEN.get(name, set())
    if "chest" in UNSEEN.get(name, set()) and "spine" not in UNSEEN[name]:
        poses[:, JOINTS.index("chest")] = [0, 0, 0, 1]  # one joint turns the whole trunk
    for place in range(10):
        camera = Rotation.random(random_state=100 + place)
        sent = np.stack([rendered(source, pose, camera, axes_of_rotations, place) for pose in poses])
        local, observed = adapt(source, sent, np.ones(sent.shape[:-1], np.bool_), axes=axes_of_rotations)  # type: ignore[arg-type]
        assert np.array_equal(observed, np.broadcast_to(seen, observed.shape))
        difference = (Rotation.from_quat(local[:, seen].reshape(-1, 4)).inv()
                      * Rotation.from_quat(poses[:, seen].reshape(-1, 4)))  # fmt: skip
        assert difference.magnitude().max() < 1e-9
        assert np.array_equal(local[:, ~seen], np.broadcast_to([0, 0, 0, 1], local[:, ~seen].shape))


@pytest.mark.parametrize("name", RENDERED)
def test_an_n_pose_is_the_identity(name: str) -> None:
    source = skeleton(name)
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (13, 1))
    sent = rendered(source, rest, Rotation.random(random_state=1), source.axes)
    local, _ = adapt(source, sent, np.ones(len(source.joints), np.bool_), axes=source.axes)
    assert np.allclose(np.abs(local[:, 3]), 1.0, atol=1e-12)


def test_what_each_source_gives_by_default() -> None:
    wanted = {
        "c13": ("local", "xyzw", False, 13),
        "kinect_v2": ("global", "xyzw", True, 25),
        "kinect_v1": ("global", "xyzw", True, 20),
        "azure_kinect": ("global", "wxyz", True, 32),
        "nite": ("global", "xyzw", True, 15),
        "nuitrack": ("global", "xyzw", True, 24),
        "ros4hri": ("local", "xyzw", False, 11),
        "xsens_mvn": ("global", "wxyz", False, 23),
        "smpl": ("local", "xyzw", False, 24),
        "ebmdb": ("local", "xyzw", False, 23),
        "cmu": ("local", "xyzw", False, 31),
    }
    assert {
        name: (known.axes, known.quaternion, known.noisy, len(known.joints)) for name, known in SKELETONS.items()
    } == wanted


def test_joint_numbers_are_those_of_the_sensors() -> None:
    kinect, azure, xsens, smpl = (skeleton(name) for name in ("kinect_v2", "azure_kinect", "xsens_mvn", "smpl"))
    assert [kinect.joints[index] for index in (0, 1, 20, 2, 3, 5, 7, 21, 24)] == [
        "SpineBase", "SpineMid", "SpineShoulder", "Neck", "Head", "ElbowLeft", "HandLeft", "HandTipLeft", "ThumbRight",
    ]  # fmt: skip
    assert [azure.joints[index] for index in (0, 2, 5, 12, 18, 26, 31)] == [
        "PELVIS", "SPINE_CHEST", "SHOULDER_LEFT", "SHOULDER_RIGHT", "HIP_LEFT", "HEAD", "EAR_RIGHT",
    ]  # fmt: skip
    assert [xsens.joints[index - 1] for index in (1, 5, 9, 13, 17, 23)] == [
        "Pelvis", "T8", "RightUpperArm", "LeftUpperArm", "RightLowerLeg", "LeftToe",
    ]  # fmt: skip
    assert smpl.parents == (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)


def test_leaf_joints_that_send_zeros_cost_nothing() -> None:
    source = skeleton("kinect_v2")
    sent = rendered(source, motion()[0], Rotation.identity(), "global")
    for joint, name in enumerate(source.joints):
        if name.startswith(("Head", "HandTip", "Thumb", "Foot")):
            sent[joint] = 0.0
    _, observed = adapt(source, sent, np.ones(25, np.bool_), axes="global")
    assert observed.all()


def test_rows_of_the_published_tables() -> None:
    """A few alignments as the tables print them, w first."""
    half = np.sqrt(0.5)
    rows = {
        ("kinect_v2", "l_uparm"): (0, 0, 0, 1),
        ("kinect_v2", "l_thigh"): (0, half, 0, half),
        ("kinect_v2", "r_shank"): (0, half, 0, -half),
        ("azure_kinect", "head"): (0.5, 0.5, 0.5, 0.5),
        ("azure_kinect", "r_thigh"): (0.5, -0.5, 0.5, -0.5),
        ("azure_kinect", "l_uparm"): (0.5, 0.5, -0.5, -0.5),
        ("azure_kinect", "r_forearm"): (0.5, -0.5, -0.5, 0.5),
        ("azure_kinect", "l_hand"): (half, 0, 0, -half),
        ("azure_kinect", "r_hand"): (0, half, half, 0),
    }
    for (name, segment), (w, x, y, z) in rows.items():
        assert abs(float(np.dot(skeleton(name).bind[SEGMENTS.index(segment)], [x, y, z, w]))) == pytest.approx(1.0)
