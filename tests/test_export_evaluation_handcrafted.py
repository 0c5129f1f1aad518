"""Handcrafted features, against motions whose features are known."""

import numpy as np
import pytest

from fervor_export.clip import Clip
from fervor_export.evaluation.handcrafted import features, matrix
from fervor_export.synthetic import synthesise_dataset


def arm_turning(radians: np.ndarray, joint: int = 3) -> Clip:
    """One joint about X, everything else hanging."""
    rotations = np.zeros((len(radians), 13, 4), np.float32)
    rotations[..., 3] = 1.0
    rotations[:, joint, 0], rotations[:, joint, 3] = np.sin(radians / 2), np.cos(radians / 2)
    return Clip(rotations, np.ones((len(radians), 13), bool), "joy", 0.5, "a", "n")


def test_a_swinging_arm_has_the_speed_of_its_radius():
    rate = 1.5  # rad/s
    seen = features(arm_turning(np.arange(60) * rate / 30.0))
    assert seen["speed_l_wrist_p50"] == pytest.approx(0.57 * rate, rel=5e-3)
    assert seen["speed_l_elbow_p50"] == pytest.approx(0.32 * rate, rel=5e-3)
    assert seen["acceleration_l_wrist_p50"] == pytest.approx(0.57 * rate**2, rel=1e-2)
    assert seen["speed_r_wrist_max"] == pytest.approx(0.0, abs=1e-9)
    assert seen["kinetic_energy_p50"] == pytest.approx(0.5 * rate**2 * (1.5 * 0.57**2 + 2.0 * 0.32**2), rel=1e-2)
    assert seen["handedness"] == pytest.approx(1.0)


def test_angles_and_distances_of_held_poses():
    rest = features(arm_turning(np.zeros(30)))
    assert rest["angle_l_elbow_mean"] == pytest.approx(np.pi)
    assert rest["angle_l_knee_mean"] == pytest.approx(np.pi)
    assert rest["angle_lean_mean"] == pytest.approx(0.0, abs=1e-7)
    assert rest["angle_twist_mean"] == pytest.approx(0.0, abs=1e-7)
    assert rest["l_wrist_to_r_wrist_mean"] == pytest.approx(0.34)
    assert rest["symmetry"] == pytest.approx(0.0)
    bent = features(arm_turning(np.full(30, -np.pi / 2), joint=4))
    assert bent["angle_l_elbow_mean"] == pytest.approx(np.pi / 2, abs=1e-6)
    assert bent["speed_l_wrist_max"] == pytest.approx(0.0, abs=1e-9)


def test_directness_of_there_and_back():
    way = np.concatenate([np.linspace(0, 1, 40), np.linspace(1, 0, 40)])
    assert features(arm_turning(way))["directness_l_wrist"] < 0.05
    assert features(arm_turning(np.linspace(0, 0.3, 80)))["directness_l_wrist"] > 0.98


def test_scale_scales_lengths_and_no_angles():
    clip = synthesise_dataset(clips=1, seed=1)[0]
    plain, large = features(clip), features(clip, scale=1.3)
    assert large["speed_l_wrist_mean"] == pytest.approx(1.3 * plain["speed_l_wrist_mean"])
    assert large["volume_mean"] == pytest.approx(1.3**3 * plain["volume_mean"])
    for name, value in plain.items():
        if name.startswith("angle"):
            assert large[name] == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize("frames", [1, 2, 3, 5, 8])
def test_short_clips_have_all_features(frames):
    table = matrix([arm_turning(np.linspace(0, 1, frames)), arm_turning(np.zeros(50))])
    assert table.shape == (2, 268)
    assert np.isfinite(table).all()
