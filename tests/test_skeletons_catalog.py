"""One motion, rendered as every sensor of the catalogue would report it, comes back as the same motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.adapter import adapt
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.rig import JOINTS, SEGMENTS
from sensors import HERE, UNSEEN, Array, as_seen, rendered

RENDERED = [name for name in SKELETONS if name != "c13"]


def motion(seed: int = 0, frames: int = 12) -> Array:
    """Canonical local rotations [frame, 13, 4]."""
    return Rotation.random(frames * 13, random_state=seed).as_quat().reshape(frames, 13, 4)


@pytest.mark.parametrize("axes_of_rotations", ["local", "global"])
@pytest.mark.parametrize("name", RENDERED)
def test_one_motion_through_every_sensor(name: str, axes_of_rotations: str) -> None:
    source = skeleton(name)
    poses = as_seen(source, motion())
    seen = np.array(source.sees)
    assert {joint for joint, here in zip(JOINTS, seen, strict=True) if not here} == UNSEEN.get(name, set())
    for place in range(10):
        camera = Rotation.random(random_state=100 + place)
        sent = rendered(source, poses, camera, axes=axes_of_rotations, seed=place)
        local, observed = adapt(source, sent, np.ones(sent.shape[:-1], np.bool_), axes=axes_of_rotations)  # type: ignore[arg-type]
        assert np.array_equal(observed, np.broadcast_to(seen, observed.shape))
        difference = (Rotation.from_quat(local[:, seen].reshape(-1, 4)).inv()
                      * Rotation.from_quat(poses[:, seen].reshape(-1, 4)))  # fmt: skip
        assert difference.magnitude().max() < 1e-9
        assert np.array_equal(local[:, ~seen], np.broadcast_to([0, 0, 0, 1], local[:, ~seen].shape))


@pytest.mark.parametrize("name", RENDERED)
def test_an_n_pose_is_the_identity(name: str) -> None:
    source = skeleton(name)
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (1, 13, 1))
    sent = rendered(source, rest, Rotation.random(random_state=1))[0]
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
    sent = rendered(source, motion()[:1], HERE, axes="global")[0]
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
