"""The same movement seen otherwise: exact where it must be, and filled in as the session fills it in."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fervor.rotations import angle_between
from fervor.session import timeline
from fervor_export.evaluation.disturbances import (
    INTERPOLATE_S,
    armless,
    at_rate,
    disturbances,
    from_camera,
    from_points,
    mirrored,
    regrid,
    with_lost_frames,
)
from fervor_export.evaluation.estimator import Motion, NetworkEstimator, Reading
from fervor_export.evaluation.invariance import EXACT, invariance
from fervor_export.synthetic import synthesise_dataset
from networks import network

CLIPS = synthesise_dataset(clips=12, seed=3)
MOTION = Motion.of(max(CLIPS, key=lambda clip: clip.mask.mean()))


def apart(one: Motion, other: Motion) -> float:
    both = one.mask & other.mask
    return float(angle_between(one.rotations.astype(float), other.rotations.astype(float))[both].max())


def test_exact_disturbances_change_no_prediction():
    changes = invariance([(NetworkEstimator(network()), CLIPS)], Reading(last=False))
    assert [change.name for change in changes] == [disturbance.name for disturbance in disturbances()]
    for change in changes:
        assert not change.promised or (change.kept and change.most <= EXACT), change
    by_name = {change.name: change for change in changes}
    assert by_name["one_arm"].most > EXACT
    assert by_name["mirror"].most > EXACT
    assert by_name["rate_15"].mean < by_name["one_arm"].mean
    assert {change.name for change in changes if change.promised} >= {
        "all_bones_0.7", "all_bones_1.3", "camera_points", "camera_rotations", "rate_30",
    }  # fmt: skip


def test_a_cap_on_clips_is_kept():
    estimator = NetworkEstimator(network())
    changes = invariance([(estimator, CLIPS[:6]), (estimator, CLIPS[6:])], Reading(last=False), most=5)
    assert {change.clips for change in changes} == {5}


def test_a_turned_camera_changes_no_pose():
    for turn in Rotation.random(4, random_state=0).as_quat():
        assert apart(from_camera(MOTION, turn), MOTION) < 1e-3
        assert apart(from_points(MOTION, camera=turn), from_points(MOTION)) < 1e-3


def test_bones_change_no_pose():
    for bones in ({}, {"elbow": 1.3, "wrist": 0.7}, {"knee": 0.7}):
        assert apart(from_points(MOTION, scale=0.7, bones=bones), from_points(MOTION)) < 1e-3


def test_mirrors_and_arms():
    assert apart(mirrored(mirrored(MOTION)), MOTION) < 1e-6
    one = armless(MOTION)
    assert not one.mask[:, 3:6].any()
    assert (one.mask[:, 6:] == MOTION.mask[:, 6:]).all()


def test_rates():
    assert len(at_rate(MOTION, 30.0)) == len(MOTION)
    assert apart(at_rate(MOTION, 30.0), MOTION) < 1e-6
    slow = at_rate(MOTION, 15.0)
    np.testing.assert_allclose(slow.rotations[::2], MOTION.rotations[: len(slow) : 2], atol=1e-6)
    for rate in (60.0, 120.0):
        assert 0 < len(MOTION) - len(at_rate(MOTION, rate)) <= 1


def test_lost_frames_leave_the_first():
    seen = with_lost_frames(MOTION, 0.3, np.random.default_rng(0))
    assert 0.9 * len(MOTION) < len(seen) <= len(MOTION)
    np.testing.assert_allclose(seen.rotations[0], MOTION.rotations[0])


def test_the_sessions_limit_is_ours():
    assert timeline.INTERPOLATE_S == INTERPOLATE_S


@given(
    st.lists(
        st.sampled_from([1 / 120, 1 / 60, 1 / 30, 1 / 15, 0.1, 0.2, 0.24, 0.3, 0.7, 0.95]), min_size=3, max_size=25
    )
)
def test_the_grid_is_the_sessions(gaps):
    times = np.concatenate(([0.0], np.cumsum(gaps)))
    poses = Rotation.random(13 * len(times), random_state=1).as_quat().reshape(-1, 13, 4).astype(np.float32)
    motion = regrid(Motion(poses, np.ones(poses.shape[:2], bool)), times)
    line, expected = None, []
    for index, time in enumerate(times):
        advanced = timeline.advance(line, float(time), rate_hz=30.0)
        line = advanced.timeline
        expected += [(index, instant.fraction, instant.held) for instant in advanced.instants]
    assert len(motion) == len(expected)
    for frame, (index, fraction, held) in enumerate(expected):
        assert motion.mask[frame].all() == (not held)
        if held:
            np.testing.assert_allclose(motion.rotations[frame], poses[index - 1], atol=1e-6)
        elif fraction > 1 - 1e-6:
            assert angle_between(motion.rotations[frame].astype(float), poses[index].astype(float)).max() < 1e-3
