"""Arms: signs, lengths and joint limits, checked by forward kinematics."""

import numpy as np
import pytest

from fervor import rotations
from fervor_export.synthetic.arm import SHOULDER, outside_body, solve

UPPER, FORE = 0.30, 0.26
DOWN = np.array([0.0, -1.0, 0.0])


def arm(wrist: list[float], *, elbow: float = 0.0, palm: float = 0.0, bend: float = 0.0, side: float = 0.0):
    """Shoulder, elbow, wrist rotations of a left arm whose wrist is `wrist` from its shoulder."""
    shoulder = np.array([SHOULDER, 0.0, 0.0])
    numbers = {"elbow_out": elbow, "palm": palm, "bend": bend, "side": side}
    return solve(
        shoulder + np.array(wrist), shoulder, **{k: np.array(v) for k, v in numbers.items()}, upper=UPPER, fore=FORE
    )


def wrist_of(turns: np.ndarray) -> np.ndarray:
    """Forward kinematics: the wrist from the shoulder."""
    forearm = rotations.multiply(turns[0], turns[1])
    return UPPER * rotations.rotate(turns[0], DOWN) + FORE * rotations.rotate(forearm, DOWN)


REACHABLE = [
    [0.1, -0.4, 0.3],
    [0.3, 0.1, 0.3],
    [-0.2, -0.1, 0.3],
    [0.1, 0.42, 0.1],
    [0.4, 0.0, 0.1],
    [0.02, -0.5, 0.05],
]


@pytest.mark.parametrize("wrist", REACHABLE)
@pytest.mark.parametrize("elbow", [0.0, 40.0, 75.0])
def test_the_wrist_is_where_it_should_be(wrist: list[float], elbow: float) -> None:
    assert np.allclose(wrist_of(arm(wrist, elbow=elbow)), wrist, atol=0.012)


def test_raising_the_left_arm_sideways_is_a_turn_about_plus_z() -> None:
    turn = rotations.to_rotvec(arm([0.6, 0.0, 0.0])[0])
    assert turn[2] > 1.2


def test_bending_the_elbow_brings_the_hand_forward_about_minus_x() -> None:
    shoulder, elbow, _ = arm([0.0, -UPPER, FORE])  # upper arm hanging, forearm straight ahead
    assert np.degrees(rotations.length(rotations.to_rotvec(shoulder))) < 20.0
    assert np.allclose(np.degrees(rotations.to_rotvec(elbow)), [-90.0, 0.0, 0.0], atol=3.0)


def test_the_elbow_of_a_hand_in_front_hangs_or_points_out() -> None:
    low, out = (rotations.rotate(arm([0.0, -0.1, 0.4], elbow=angle)[0], DOWN) for angle in (0.0, 80.0))
    assert low[1] < -0.5
    assert abs(low[0]) < 0.1
    assert out[0] > 0.4
    assert out[1] > low[1]


def test_a_palm_turned_down_brings_the_left_thumb_inward() -> None:
    shoulder, elbow, _ = arm([0.0, -UPPER, FORE], palm=80.0)
    thumb = rotations.rotate(rotations.multiply(shoulder, elbow), np.array([0.0, 0.0, 1.0]))
    assert thumb[0] < -0.8


def test_a_wrist_bends_to_the_palm_and_to_the_thumb() -> None:
    palm, thumb = arm([0.0, -0.55, 0.0], bend=40.0)[2], arm([0.0, -0.55, 0.0], side=20.0)[2]
    assert rotations.rotate(palm, DOWN)[0] < -0.5  # the left palm faces the thigh
    assert rotations.rotate(thumb, DOWN)[2] > 0.3  # the thumb points forward


def test_no_elbow_is_bent_the_wrong_way_or_too_far() -> None:
    rng = np.random.default_rng(0)
    wrists = rng.uniform(-0.8, 0.8, (5000, 3)) + np.array([SHOULDER, 0.0, 0.0])
    zero = np.zeros(5000)
    turns = solve(
        wrists, np.array([SHOULDER, 0.0, 0.0]), elbow_out=zero, palm=zero, bend=zero, side=zero, upper=UPPER, fore=FORE
    )
    flexion = -np.degrees(rotations.to_rotvec(turns[:, 1]))[:, 0]
    assert flexion.min() >= 0.0
    assert flexion.max() < 146.0
    assert np.allclose(rotations.length(turns), 1.0)


def test_wrists_are_moved_out_of_chest_and_head() -> None:
    rng = np.random.default_rng(0)
    inside = rng.uniform((-0.14, -0.4, -0.1), (0.14, 0.25, 0.1), (5000, 3))
    moved = outside_body(inside)
    chest = moved[moved[:, 1] < -0.05]
    assert (np.hypot(chest[:, 0] / 0.165, chest[:, 2] / 0.125) > 0.97).all()
    far = np.array([[0.4, -0.2, 0.3], [0.3, 0.4, 0.1]])
    assert np.allclose(outside_body(far), far, atol=0.004)
