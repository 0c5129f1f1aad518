"""Holding, jumping, and the way between two poses, against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from bodies import motion, terms
from fervor.engine.posing import JUMP_RAD, JUMPS_BELIEVED, Poses, adapt_all, between, hold, reject_jumps
from fervor.rotations import angle_between, multiply, slerp
from fervor.session.body import Body
from fervor.session.events import Pose
from fervor.skeletons.positions import no_hinges

ALL = np.ones((1, 13), np.bool_)
NOISY = np.array([True])


def poses(seed, observed=ALL) -> Poses:
    return Poses(motion(1, seed=seed), observed.copy())


def test_between_is_slerp():
    old, new = poses(1), poses(2)
    for fraction in (0.0, 0.1, 0.5, 0.99, 1.0):
        rotations, mask = between(old, new, np.array([fraction]), np.array([False]))
        for joint in range(13):
            ends = Rotation.from_quat([old.rotations[0, joint], new.rotations[0, joint]])
            expected = Slerp([0, 1], ends)(fraction)
            assert (expected.inv() * Rotation.from_quat(rotations[0, joint])).magnitude() < 1e-6
        assert mask.all()


def test_between_counts_a_joint_where_both_poses_show_it():
    unseen = ALL.copy()
    unseen[0, 4] = False
    for old, new in ((poses(1, unseen), poses(2)), (poses(1), poses(2, unseen))):
        _, mask = between(old, new, np.array([0.5]), np.array([False]))
        assert mask[0].tolist() == unseen[0].astype(float).tolist()
    _, mask = between(poses(1, unseen), poses(2), np.array([1.0]), np.array([False]))
    assert mask.all()


def test_a_held_step_keeps_the_old_pose_unobserved():
    old = poses(1)
    rotations, mask = between(old, poses(2), np.array([0.4]), np.array([True]))
    assert np.array_equal(rotations, old.rotations.astype(np.float32))
    assert not mask.any()


def test_holes_hold_the_rotation_they_had():
    unseen = ALL.copy()
    unseen[0, [0, 7]] = False
    old, new = poses(1), poses(2, unseen)
    held = hold(new, old)
    assert np.array_equal(held.rotations[0, [0, 7]], old.rotations[0, [0, 7]])
    assert np.array_equal(held.rotations[0, 1], new.rotations[0, 1])


def flipped(base: Poses) -> Poses:
    turned = base.rotations.copy()
    turned[0, 5] = (Rotation.from_quat(turned[0, 5]) * Rotation.from_rotvec([0, 3.0, 0])).as_quat()
    return Poses(turned, base.observed.copy())


def test_a_flip_is_rejected_until_it_has_settled():
    old, jumps = poses(1), np.zeros((1, 13), np.int64)
    for attempt in range(1, JUMPS_BELIEVED + 1):
        new, jumps, rejected = reject_jumps(flipped(old), old, jumps, NOISY)
        believed = attempt == JUMPS_BELIEVED
        assert rejected[0, 5] == (not believed)
        assert new.observed[0, 5] == believed
    assert jumps[0, 5] == 0


def test_what_is_surely_near_needs_no_angle():
    """Turns on both sides of the bound, and of where the angle is left out: what is rejected is what turned too far."""
    degrees = np.concatenate([np.linspace(0, 180, 61), 120 + np.array([-0.2, -1e-3, -1e-6, 0, 1e-6, 1e-3, 0.2])])
    old = Poses(motion(len(degrees), seed=4), np.ones((len(degrees), 13), np.bool_))
    turn = Rotation.from_rotvec(np.radians(degrees)[:, None] * np.array([0.0, 0.6, 0.8])).as_quat()
    new = Poses(multiply(old.rotations, turn[:, None]), old.observed)
    far = angle_between(old.rotations, new.rotations) > JUMP_RAD
    assert far.any(axis=1).sum() > 20
    for rows in (slice(None), *(slice(row, row + 1) for row in range(len(degrees)))):
        some = tuple(Poses(each.rotations[rows], each.observed[rows]) for each in (new, old))
        noisy = np.ones(len(some[0].rotations), np.bool_)
        came, jumps, rejected = reject_jumps(*some, np.zeros(some[0].observed.shape, np.int64), noisy)
        assert np.array_equal(rejected, far[rows])
        assert np.array_equal(came.observed, ~far[rows])
        assert np.array_equal(jumps, far[rows])


def test_a_precise_sensor_may_turn_as_far_as_it_likes():
    old = poses(1)
    new, _, rejected = reject_jumps(flipped(old), old, np.zeros((1, 13), np.int64), np.array([False]))
    assert new.observed.all()
    assert not rejected.any()


def test_the_first_sight_of_a_joint_is_no_jump():
    old = Poses(motion(1, seed=1), ~ALL)
    _, _, rejected = reject_jumps(flipped(old), old, np.zeros((1, 13), np.int64), NOISY)
    assert not rejected.any()


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_adapting_a_mixed_batch_gives_each_row_what_it_gets_alone(count):
    names = ["c13", "ebmdb", "cmu"]
    tickets = []
    for row in range(count):
        agreed = terms(names[row % 3])
        joints = len(agreed.source.skeleton.joints)
        rotations = motion(1, seed=row, joints=joints)[0]
        body = Body(str(row), row, agreed)
        tickets.append(body.plan(0, 0.0, Pose(rotations, np.arange(joints) != row % joints)))
    together = adapt_all(tickets, no_hinges((count,))).poses
    for row, ticket in enumerate(tickets):
        alone = adapt_all([ticket], no_hinges((1,))).poses
        assert np.array_equal(together.rotations[row], alone.rotations[0])
        assert np.array_equal(together.observed[row], alone.observed[0])


@pytest.mark.parametrize("arrived", [np.ones(6, np.bool_), np.arange(6) % 2 == 0, np.zeros(6, np.bool_)])
@pytest.mark.parametrize("held", [np.zeros(6, np.bool_), np.arange(6) % 3 == 0])
def test_a_batch_on_its_way_gives_each_row_what_it_gets_alone(arrived, held):
    """What is left out where all have arrived changes no bit."""
    random = np.random.default_rng(3)
    old, new = (Poses(motion(6, seed=seed), random.random((6, 13)) < 0.8) for seed in (1, 2))
    fraction = np.where(arrived, 1.0, random.random(6))
    rotations, mask = between(old, new, fraction, held)
    for row in range(6):
        one = slice(row, row + 1)
        a, b = (Poses(each.rotations[one], each.observed[one]) for each in (old, new))
        turned = slerp(
            a.rotations, b.rotations, np.full((1, 13), fraction[row])
        )  # the plain way: turn all, then choose
        expected = np.where(held[row], a.rotations, np.where(arrived[row], b.rotations, turned)).astype(np.float32)
        seen = np.where(arrived[row], b.observed, a.observed & b.observed) & ~held[row]
        assert np.array_equal(rotations[one], expected)
        assert np.array_equal(mask[one], seen.astype(np.float32))
