"""What contestants are judged by: poses on a grid, and two states in turn."""

from dataclasses import replace

import numpy as np
import pytest

from fervor.model import Model, default_model_path
from fervor.rotations import from_rotvec, to_rotvec
from fervor_bench.reference import expected_intensities, on_grid
from fervor_bench.traffic import Traffic

EVEN = Traffic(jitter_s=0.0)


def turned(angles) -> np.ndarray:
    """One joint that turns about x: [picture, 1, 4]."""
    vectors = np.zeros((len(angles), 1, 3))
    vectors[:, 0, 0] = angles
    return from_rotvec(vectors).astype(np.float32)


def test_poses_come_to_the_grid_at_constant_speed() -> None:
    poses, newest = on_grid(turned([0.0, 0.3, 0.9]), np.array([5.0, 5.15, 5.3]), 10.0)
    angles = to_rotvec(poses.astype(np.float64))[:, 0, 0]
    assert angles == pytest.approx([0.0, 0.2, 0.5, 0.9], abs=1e-6)  # at 5.0, 5.1, 5.2, 5.3
    assert newest.tolist() == [0, 1, 3]


def test_a_picture_between_two_steps_brings_none() -> None:
    _, newest = on_grid(turned([0.0, 0.1, 0.2]), np.array([0.0, 0.04, 0.08]), 10.0)
    assert newest.tolist() == [0, 0, 0]


def test_times_on_the_grid_change_nothing() -> None:
    with_grid = expected_intensities(EVEN, 60, grid=True, states=1)
    np.testing.assert_allclose(with_grid, expected_intensities(EVEN, 60, grid=False, states=1), atol=1e-6)


def test_two_states_hand_over_and_speak_as_if_they_had_begun_by_themselves() -> None:
    one = expected_intensities(EVEN, 300, grid=False, states=1)
    two = expected_intensities(EVEN, 300, grid=False, states=2)
    np.testing.assert_array_equal(two[:225], one[:225])  # the last half second of eight fades
    assert np.abs(two[240:] - one[240:]).max() > 1e-4
    model = Model.load(default_model_path())
    rotations = EVEN.motion(0)[None, 120:300]  # begun after four seconds
    joy = np.eye(11, dtype=np.float32)[[model.metadata.emotions.index("joy")]][None].repeat(180, axis=1)
    alone = model.run(rotations, np.ones((1, 180, 13), np.float32), joy, model.zero_states(1)).intensity[0]
    np.testing.assert_allclose(two[240:300], alone[120:180], atol=1e-6)
    fading = (two[225:240] - one[225:240]) / (alone[105:120] - one[225:240])
    np.testing.assert_allclose(fading, np.arange(1, 16) / 16, atol=1e-3)


def test_a_label_that_is_none_of_the_models_is_unknown() -> None:
    unknown = expected_intensities(replace(EVEN, emotion="unknown"), 30, grid=False, states=1)
    assert np.abs(unknown - expected_intensities(EVEN, 30, grid=False, states=1)).max() > 1e-4
