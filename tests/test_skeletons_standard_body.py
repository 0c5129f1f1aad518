"""The standard body, against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.standard_body import BONES, MIDHIP, points, segments

REST = np.tile([0.0, 0.0, 0.0, 1.0], (1, 13, 1))


def test_hanging_arms_in_the_reference_pose():
    at = {name: place[0] for name, place in points(REST).items()}
    assert at["l_wrist"] == pytest.approx([0.17, 0.49 - 0.57, 0.0])
    assert at["r_wrist"] == pytest.approx([-0.17, 0.49 - 0.57, 0.0])
    assert at["l_ankle"][1] == pytest.approx(-0.84)
    assert at[MIDHIP] == pytest.approx([0, 0, 0])
    assert at["head"][1] - at["l_ankle"][1] == pytest.approx(1.52, abs=0.01)  # an adult of 1.70 m


def test_segments_are_scipys():
    local = Rotation.random(7 * 13, random_state=1).as_quat().reshape(7, 13, 4)
    whole = [Rotation.identity(7)] * len(SEGMENTS)
    for joint in range(len(JOINTS)):
        whole[CHILD_SEGMENT[joint]] = whole[PARENT_SEGMENT[joint]] * Rotation.from_quat(local[:, joint])
    for name, turned in segments(local).items():
        assert np.abs((Rotation.from_quat(turned).inv() * whole[SEGMENTS.index(name)]).magnitude()).max() < 1e-7


def test_bones_keep_their_lengths_and_scale():
    local = Rotation.random(5 * 13, random_state=2).as_quat().reshape(5, 13, 4)
    plain, large, long = points(local), points(local, scale=1.3), points(local, bones={"elbow": 0.7})
    for name, (start, _, offset) in BONES.items():
        for body, factor in ((plain, 1.0), (large, 1.3), (long, 0.7 if name == "l_elbow" else 1.0)):
            bone = body[name] - body[start or MIDHIP]
            assert np.linalg.norm(bone, axis=1) == pytest.approx(factor * np.linalg.norm(offset))
