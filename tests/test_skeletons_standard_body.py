"""The standard body, against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.standard_body import BONES, HIPS_ABOVE_GROUND_M, MIDHIP, OFFSETS_M, TIPS_M, points, segments

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


AT = {
    "head": "neck", "l_uparm": "l_shoulder", "r_uparm": "r_shoulder", "l_forearm": "l_elbow", "r_forearm": "r_elbow",
    "l_hand": "l_wrist", "r_hand": "r_wrist", "l_thigh": "l_hip", "r_thigh": "r_hip", "l_shank": "l_knee",
    "r_shank": "r_knee",
}  # fmt: skip


def test_a_tree_of_its_offsets_is_the_same_body():
    local = Rotation.random(5 * 13, random_state=3).as_quat().reshape(5, 13, 4)
    body, turned = points(local), {name: Rotation.from_quat(quats) for name, quats in segments(local).items()}
    at = {"pelvis": np.zeros((5, 3))}
    for above, below in zip(PARENT_SEGMENT, CHILD_SEGMENT, strict=True):
        parent, child = SEGMENTS[above], SEGMENTS[below]
        at[child] = at[parent] + turned[parent].apply(OFFSETS_M[child])
    for segment, point in AT.items():
        assert at[segment] == pytest.approx(body[point])
    for side in "lr":
        ankle = at[f"{side}_shank"] + turned[f"{side}_shank"].apply(TIPS_M[f"{side}_shank"])
        assert ankle == pytest.approx(body[f"{side}_ankle"])


def test_a_standing_body_is_of_its_height():
    crown = sum(OFFSETS_M[name][1] for name in ("abdomen", "thorax", "head")) + TIPS_M["head"][1]
    assert HIPS_ABOVE_GROUND_M + crown == pytest.approx(1.70, abs=0.01)
    sole = HIPS_ABOVE_GROUND_M + sum(OFFSETS_M[name][1] for name in ("l_thigh", "l_shank")) + TIPS_M["l_shank"][1]
    assert sole == pytest.approx(0.039 * 1.70, abs=0.001)  # Winter 2009: the ankle
