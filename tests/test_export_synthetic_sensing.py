"""Sensors: masks are honest, held joints stand still, offsets are constant rotations of segments."""

import numpy as np
import pytest

from fervor import rotations
from fervor.skeletons.rig import JOINTS
from fervor_export.synthetic.motion import synthesise_motion
from fervor_export.synthetic.sensing import KINDS, continuous, hold, misalign, respine, roll_in_wrists, sense, smooth

MOTION = synthesise_motion(emotion="joy", intensity=0.8, seconds=6.0, seed=1)[1]


def speed(motion: np.ndarray) -> np.ndarray:
    return np.degrees(rotations.angle_between(motion[:-1], motion[1:]))


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_sensor_gives_unit_rotations_and_holds_what_it_does_not_see(kind) -> None:
    for seed in range(12):
        seen, mask = sense(np.random.default_rng(seed), MOTION, kind)
        assert seen.shape == MOTION.shape
        assert mask.shape == MOTION.shape[:2]
        assert np.allclose(rotations.length(seen), 1.0)
        assert np.abs(np.diff(seen, axis=0)[~mask[1:]]).max(initial=0.0) == 0.0


def test_a_joint_never_seen_is_the_identity() -> None:
    mask = np.ones(MOTION.shape[:2], bool)
    mask[:, 5] = False
    mask[10:20, 3] = False
    held = hold(MOTION, mask)
    assert (held[:, 5] == rotations.IDENTITY).all()
    assert (held[10:20, 3] == MOTION[9, 3]).all()
    assert np.array_equal(held[mask], MOTION[mask])


def test_a_misaligned_sensor_turns_the_pose_but_not_how_fast_it_moves() -> None:
    askew = misalign(MOTION, np.random.default_rng(0), 20.0)
    offset = np.degrees(rotations.angle_between(askew, MOTION))
    assert 8.0 < offset.mean() < 50.0
    assert np.allclose(speed(askew), speed(MOTION), atol=1e-6)


def test_skeletons_cut_a_spine_in_different_places_and_bend_it_alike() -> None:
    def thorax(motion: np.ndarray) -> np.ndarray:
        return rotations.multiply(motion[:, 0], motion[:, 1])

    low, high = respine(MOTION, 0.8), respine(MOTION, 0.3)
    assert np.degrees(rotations.angle_between(thorax(low), thorax(MOTION))).max() < 1e-4
    assert np.degrees(rotations.angle_between(thorax(low), thorax(high))).max() < 1e-4
    bent = [np.degrees(rotations.length(rotations.to_rotvec(motion[:, 0]))).mean() for motion in (low, high)]
    assert np.isclose(bent[0] / bent[1], 0.8 / 0.3)
    assert np.array_equal(low[:, 2:], MOTION[:, 2:])


def test_a_hand_that_is_turned_in_the_wrist_points_where_the_other_does() -> None:
    moved = roll_in_wrists(MOTION)
    for elbow, wrist in ((4, 5), (7, 8)):
        hands = [rotations.multiply(motion[:, elbow], motion[:, wrist]) for motion in (moved, MOTION)]
        assert np.degrees(rotations.angle_between(*hands)).max() < 1e-4
        down = np.array([0.0, -1.0, 0.0])
        assert np.allclose(rotations.rotate(moved[:, elbow], down), rotations.rotate(MOTION[:, elbow], down))
        twist = rotations.normalise(moved[:, elbow])[:, 1]
        assert np.abs(twist).max() < 1e-9


def test_a_filter_lags_and_calms() -> None:
    slow = smooth(MOTION, 0.1)
    assert np.array_equal(smooth(MOTION, 0.0), MOTION)
    assert speed(slow).max() < speed(MOTION).max()
    still = np.repeat(MOTION[:1], 20, axis=0)
    assert np.allclose(smooth(still, 0.1), still)


def test_signs_are_made_continuous() -> None:
    flipped = MOTION * np.where(np.random.default_rng(0).random(MOTION.shape[:2]) < 0.5, -1.0, 1.0)[..., None]
    same = continuous(flipped)
    assert ((same[1:] * same[:-1]).sum(-1) > 0.0).all()
    assert np.allclose(rotations.angle_between(same, MOTION), 0.0, atol=1e-7)


def test_depth_cameras_are_noisier_than_optical_systems_most_at_the_wrists() -> None:
    def noise(kind, name: str) -> float:
        still = np.repeat(MOTION[:1], 120, axis=0)
        takes = [sense(np.random.default_rng(seed), still, kind) for seed in range(40)]
        joint = JOINTS.index(name)
        return float(np.mean([speed(seen)[:, joint].mean() for seen, mask in takes if mask[:, joint].all()]))

    assert noise("depth", "l_wrist") > noise("depth", "chest") > noise("optical", "chest")


def test_every_kind_loses_legs_now_and_then_and_cameras_lose_wrists() -> None:
    def lost(kind, name: str) -> float:
        takes = [sense(np.random.default_rng(seed), MOTION, kind)[1] for seed in range(60)]
        return float(np.mean([not mask[:, JOINTS.index(name)].any() for mask in takes]))

    assert all(0.1 < lost(kind, "l_knee") < 0.7 for kind in KINDS)
    assert lost("landmarks", "r_wrist") > 0.4
    assert lost("suit", "l_shoulder") == 0.0
