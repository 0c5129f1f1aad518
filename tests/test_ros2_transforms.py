"""Poses from TF: whatever the tree of frames is, once for every stamp."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.ros4hri import ROS4HRI
from fervor_ros.human_description import AXES, CHAINS, link_rotations
from fervor_ros.pose import Pose
from fervor_ros.transforms import Transform, Transforms

MS = 1_000_000
DICE = np.random.default_rng(7)


def random_angles() -> dict[str, float]:
    return dict(zip(AXES, DICE.uniform(-1.5, 1.5, len(AXES)).tolist(), strict=True))


def urdf_frames(angles: dict[str, float], stamp: int, *, body: str = "b1") -> tuple[list[Transform], list[Transform]]:
    """What a robot_state_publisher makes of joint angles: moving frames, and fixed ones."""
    moving, fixed = [], []
    for index, link in enumerate(ROS4HRI.joints[1:], 1):
        above = ROS4HRI.joints[ROS4HRI.parents[index]]
        for joint in CHAINS[link]:
            ends = joint == CHAINS[link][-1] and link not in ("torso", "head")
            frame = link if ends else joint
            turn = Rotation.from_rotvec(np.array(AXES[joint]) * angles[joint]).as_quat()
            moving.append(Transform(f"{frame}_{body}", f"{above}_{body}", turn, stamp))
            above = frame
        if link in ("torso", "head"):
            fixed.append(Transform(f"{link}_{body}", f"{above}_{body}", np.array([0.0, 0, 0, 1]), 0))
    return moving, fixed


FIXED = {transform.frame: transform for transform in urdf_frames(dict.fromkeys(AXES, 0.0), 0)[1]}


def played(transforms: Transforms, *messages: list[Transform]) -> list[Pose]:
    return [pose for message in messages for transform in message for pose in transforms.move(transform)]


def test_frames_of_the_urdf_are_its_joint_angles() -> None:
    transforms = Transforms("b1", ROS4HRI, FIXED)
    motion = [random_angles() for _ in range(3)]
    stamps = [10 * MS, 20 * MS, 30 * MS]
    messages = [urdf_frames(angles, stamp) for angles, stamp in zip(motion, stamps, strict=True)]
    poses = played(transforms, *(moving for moving, _ in messages))
    assert [pose.stamp for pose in poses] == stamps
    for pose, angles in zip(poses, motion, strict=True):
        expected = link_rotations(list(angles), list(angles.values()))
        assert np.abs(pose.rotations - expected).max() < 1e-12


@pytest.mark.parametrize("root", ["body_b1", "camera"])
def test_frames_that_all_hang_from_one(root: str) -> None:
    """As trackers without a URDF publish them: every link relative to the body, or to the camera."""
    angles = random_angles()
    local = link_rotations(list(angles), list(angles.values()))
    stands = Rotation.identity() if root == "body_b1" else Rotation.random(rng=1)
    turns = [stands]
    for index in range(1, len(ROS4HRI.joints)):
        turns.append(turns[ROS4HRI.parents[index]] * Rotation.from_quat(local[index]))
    frames = [
        Transform(f"{link}_b1", root if f"{link}_b1" != root else "camera", turn.as_quat(), MS)
        for link, turn in zip(ROS4HRI.joints, turns, strict=True)
    ]
    transforms = Transforms("b1", ROS4HRI, FIXED)
    assert played(transforms, frames) == []  # nobody knows yet that it is whole
    (pose,) = transforms.flush()
    apart = Rotation.from_quat(pose.rotations[1:]) * Rotation.from_quat(local[1:]).inv()
    assert apart.magnitude().max() < 1e-12


def test_a_pose_is_told_as_soon_as_it_is_whole_and_once() -> None:
    transforms = Transforms("b1", ROS4HRI, FIXED)
    first, _ = urdf_frames(random_angles(), MS)
    played(transforms, first)
    second, _ = urdf_frames(random_angles(), 2 * MS)
    assert [pose.stamp for pose in played(transforms, second[:-1])] == [MS]
    assert [pose.stamp for pose in played(transforms, second[-1:])] == [2 * MS]
    assert played(transforms, second) == []
    assert transforms.flush() == []


def test_a_frame_that_missed_a_stamp_is_untracked_in_its_pose_alone() -> None:
    transforms = Transforms("b1", ROS4HRI, FIXED)
    knee = next(
        index for index, transform in enumerate(urdf_frames(random_angles(), 0)[0]) if "l_knee" in transform.frame
    )
    messages = [urdf_frames(random_angles(), stamp * MS) for stamp in (1, 2, 3, 4)]
    moving = [moving for moving, _ in messages]
    del moving[1][knee]
    poses = played(transforms, *moving)
    untracked = [{ROS4HRI.joints[joint] for joint in np.flatnonzero(np.isnan(pose.rotations[:, 0]))} for pose in poses]
    assert [pose.stamp for pose in poses] == [MS, 2 * MS, 3 * MS, 4 * MS]
    assert untracked == [set(), {"l_knee"}, set(), set()]


def test_what_comes_late_is_passed_over_and_a_clock_set_back_is_not() -> None:
    transforms = Transforms("b1", ROS4HRI, FIXED)
    messages = [urdf_frames(random_angles(), stamp)[0] for stamp in (5_000 * MS, 5_010 * MS, 4_900 * MS, 100 * MS)]
    assert [pose.stamp for pose in played(transforms, *messages)] == [5_000 * MS, 5_010 * MS, 100 * MS]


def test_frames_in_a_ring_are_untracked() -> None:
    transforms = Transforms("b1", ROS4HRI, FIXED)
    still = np.array([0.0, 0, 0, 1])
    ring = [Transform("head_b1", "torso_b1", still, MS), Transform("torso_b1", "head_b1", still, MS)]
    played(transforms, ring)
    (pose,) = transforms.flush()
    assert np.isnan(pose.rotations[ROS4HRI.joints.index("torso")]).all()
