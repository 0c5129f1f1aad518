"""Features of poses, in torch, against scipy."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from fervor.skeletons.rig import JOINTS
from fervor_export.features import VELOCITY_SCALE, euler, observed, rot6d_velocity, width
from fervor_export.parity import edge_rotations
from networks import frames

RATE = 30.0
EDGES = edge_rotations().astype(np.float32)[:-1]  # without the zero quaternion

component = st.one_of(
    st.floats(-1, 1, width=32),
    st.sampled_from([0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 1e-4, -1e-4, 1e-7, -1e-7]),
)
quaternions = (
    arrays(np.float32, 4, elements=component)
    .filter(lambda q: np.linalg.norm(q) > 1e-2)
    .map(lambda q: (q / np.linalg.norm(q)).astype(np.float32))
)


def pose(q) -> torch.Tensor:
    """The rotation q at every joint of one frame: [1, 1, 13, 4]."""
    return torch.from_numpy(np.tile(np.asarray(q, np.float32), (1, 1, len(JOINTS), 1)))


def seen() -> torch.Tensor:
    return torch.ones(1, 1, len(JOINTS))


def rpy(q) -> np.ndarray:
    return euler(pose(q), seen()).reshape(len(JOINTS), 3)[0].numpy().astype(np.float64)


def rot6d(q) -> np.ndarray:
    features, _ = rot6d_velocity(pose(q), seen(), torch.zeros(1, len(JOINTS), 4), rate_hz=RATE)
    return features.reshape(len(JOINTS), 10)[0, :6].numpy()


def velocity(p, q) -> np.ndarray:
    features, _ = rot6d_velocity(pose(q), seen(), pose(p)[:, 0], rate_hz=RATE)
    return features.reshape(len(JOINTS), 10)[0, 6:9].numpy()


def check_against_scipy(q) -> None:
    matrix = Rotation.from_quat(q).as_matrix()
    roll, pitch, yaw = angles = rpy(q)
    assert np.all(np.abs(angles) <= np.float32(np.pi))
    assert abs(pitch) <= np.float32(np.pi / 2)
    # The rotation is the same everywhere, the angles wherever they are defined.
    np.testing.assert_allclose(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix(), matrix, atol=3e-4)
    if np.hypot(matrix[0, 0], matrix[1, 0]) > 1e-2:
        expected = Rotation.from_quat(q).as_euler("ZYX")[::-1]
        turns = np.abs(angles - expected)
        np.testing.assert_allclose(np.minimum(turns, 2 * np.pi - turns), 0, atol=5e-5)


@given(quaternions)
def test_roll_pitch_yaw_is_scipys(q):
    check_against_scipy(q)


@pytest.mark.parametrize("index", range(0, len(EDGES), 7))
def test_roll_pitch_yaw_at_edges(index):
    check_against_scipy(EDGES[index])


def test_roll_is_zero_at_gimbal_lock_as_in_scipy():
    for yaw in (-2.0, 0.0, 0.5, 3.0):
        q = Rotation.from_euler("ZYX", [yaw, np.pi / 2, 0.0]).as_quat()
        np.testing.assert_allclose(rpy(q), [0.0, np.pi / 2, yaw], atol=1e-4)


def test_half_turns_have_the_sign_of_the_sine():
    np.testing.assert_allclose(rpy([1, 0, 0, 1e-4]), [np.pi - 2e-4, 0, 0], atol=1e-6)
    np.testing.assert_allclose(rpy([1, 0, 0, -1e-4]), [2e-4 - np.pi, 0, 0], atol=1e-6)
    np.testing.assert_allclose(rpy([1, 0, 0, 0]), [np.pi, 0, 0], atol=1e-6)


@given(quaternions)
def test_matrix_columns_are_scipys(q):
    matrix = Rotation.from_quat(q).as_matrix()
    np.testing.assert_allclose(rot6d(q), np.concatenate([matrix[:, 0], matrix[:, 1]]), atol=1e-6)


@given(quaternions, quaternions)
def test_q_and_minus_q_are_the_same_to_the_bit(p, q):
    np.testing.assert_array_equal(rpy(q), rpy(-q))
    np.testing.assert_array_equal(rot6d(q), rot6d(-q))
    np.testing.assert_array_equal(velocity(p, q), velocity(-p, q))
    np.testing.assert_array_equal(velocity(p, q), velocity(p, -q))


@given(quaternions, arrays(np.float64, 3, elements=st.floats(-1, 1)))
def test_velocity_of_small_steps_is_the_angular_velocity(q, rate):
    step = Rotation.from_rotvec(rate / RATE)  # up to 1.7 rad/s
    after = (Rotation.from_quat(q) * step).as_quat().astype(np.float32)
    np.testing.assert_allclose(velocity(q, after), VELOCITY_SCALE * rate, atol=2e-4)


@given(quaternions, st.floats(0.01, 2.6))
def test_velocity_is_twice_the_sine_of_half_the_step(q, angle):
    step = Rotation.from_rotvec([0.0, angle, 0.0])
    after = (Rotation.from_quat(q) * step).as_quat().astype(np.float32)
    expected = 2 * np.sin(angle / 2) * RATE * VELOCITY_SCALE
    np.testing.assert_allclose(velocity(q, after), [0, expected, 0], atol=2e-5 * RATE)


def test_velocity_fades_towards_half_turns():
    sizes = [
        np.linalg.norm(velocity([0, 0, 0, 1], [np.sin(a / 2), 0, 0, np.cos(a / 2)]))
        for a in np.deg2rad([150, 165, 180])
    ]
    assert sizes[0] > sizes[1] > sizes[2]
    assert sizes[2] < 1e-5


@pytest.mark.parametrize("lost", [[0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1], [0, 0, 0, 0.3], [3, 3, 3, 3]])
def test_what_is_no_rotation_counts_as_unobserved(lost):
    rotations, mask = pose([0, 0, 0, 1]), seen()
    rotations[0, 0, 4] = torch.tensor(lost, dtype=torch.float32)
    assert observed(rotations, mask)[0, 0].tolist() == [joint != 4 for joint in range(len(JOINTS))]
    features, state = rot6d_velocity(rotations, mask, pose([0, 0, 0, 1])[:, 0], rate_hz=RATE)
    assert not features.reshape(len(JOINTS), 10)[4].any()
    assert not state[0, 4].any()
    assert not euler(rotations, mask).reshape(len(JOINTS), 3)[4].any()


def test_masked_joints_give_zeros_and_no_velocity_after():
    rotations, mask, _ = map(torch.from_numpy, frames(2, 6))
    mask[:] = 1
    mask[:, 2, 7] = 0
    features, state = rot6d_velocity(rotations, mask, torch.zeros(2, len(JOINTS), 4), rate_hz=RATE)
    joint = features.reshape(2, 6, len(JOINTS), 10)[:, :, 7]
    assert not joint[:, 2].any()
    assert not joint[:, 3, 6:9].any()
    assert joint[:, 4, 6:9].all()
    torch.testing.assert_close(state, rotations[:, -1])


def test_at_a_reset_nothing_moves():
    rotations, mask, _ = map(torch.from_numpy, frames(2, 3))
    features, _ = rot6d_velocity(rotations, mask, torch.zeros(2, len(JOINTS), 4), rate_hz=RATE)
    joints = features.reshape(2, 3, len(JOINTS), 10)
    assert not joints[:, 0, :, 6:9].any()
    assert joints[:, 1, :, 6:9].any()


def test_scale_does_not_matter():
    rotations, mask, _ = map(torch.from_numpy, frames(2, 3))
    zero = torch.zeros(2, len(JOINTS), 4)
    torch.testing.assert_close(euler(rotations, mask), euler(1.5 * rotations, mask), atol=1e-5, rtol=0)
    torch.testing.assert_close(
        rot6d_velocity(rotations, mask, zero, rate_hz=RATE), rot6d_velocity(0.6 * rotations, mask, zero, rate_hz=RATE)
    )


def test_values_and_gradients_are_finite_at_edges():
    edges = torch.from_numpy(np.concatenate([EDGES, np.zeros((len(JOINTS) * 30 - len(EDGES), 4), np.float32)]))
    for before in (torch.zeros(30, len(JOINTS), 4), torch.ones(30, len(JOINTS), 4) / 2):
        rotations = edges.reshape(30, 1, len(JOINTS), 4).clone().requires_grad_()
        previous = before.clone().requires_grad_()
        mask = torch.ones(30, 1, len(JOINTS))
        features, state = rot6d_velocity(rotations, mask, previous, rate_hz=RATE)
        angles = euler(rotations, mask)
        assert features.isfinite().all()
        assert angles.isfinite().all()
        (features.sum() + state.sum() + angles.sum()).backward()
        assert rotations.grad.isfinite().all()
        assert previous.grad.isfinite().all()


def test_widths():
    rotations, mask, _ = map(torch.from_numpy, frames(2, 3))
    assert euler(rotations, mask).shape == (2, 3, width("euler")) == (2, 3, 39)
    features, _ = rot6d_velocity(rotations, mask, torch.zeros(2, len(JOINTS), 4), rate_hz=RATE)
    assert features.shape == (2, 3, width("rot6d+velocity")) == (2, 3, 130)
