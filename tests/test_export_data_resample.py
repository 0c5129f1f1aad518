"""The grid of clips is that of a live body: compared with the session's timeline and the engine's poses."""

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fervor.engine.posing import JUMP_RAD, JUMPS_BELIEVED, Poses, between, hold, reject_jumps
from fervor.session import timeline
from fervor_export.data import resample
from fervor_export.data.resample import on_grid, without_jumps

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def live(times: Array, local: Array, observed: Mask, *, noisy: bool = False) -> tuple[Array, Mask]:
    """What the service steps through, pose by pose."""
    old = Poses(np.tile([0.0, 0.0, 0.0, 1.0], (1, 13, 1)), np.zeros((1, 13), np.bool_))
    jumps, line = np.zeros((1, 13), np.int64), None
    rotations, masks = [], []
    for time, pose, seen in zip(times, local, observed, strict=True):
        moved = timeline.advance(line, time, rate_hz=30.0)
        new, jumps, _ = reject_jumps(Poses(pose[None], seen[None]), old, jumps, np.array([noisy]))
        new = hold(new, old)
        for instant in moved.instants:
            turned, mask = between(old, new, np.array([instant.fraction]), np.array([instant.held]))
            rotations.append(turned[0])
            masks.append(mask[0] > 0)
        old, line = new, moved.timeline
    return np.stack(rotations), np.stack(masks)


@given(
    seed=st.integers(0, 1000),
    steps=st.lists(st.sampled_from([1 / 120, 1 / 60, 1 / 30, 0.0401, 0.25, 0.26, 0.7]), min_size=1, max_size=40),
    unseen=st.floats(0, 0.6),
    noisy=st.booleans(),
)
def test_equals_a_live_body(seed: int, steps: list[float], unseen: float, noisy: bool) -> None:
    random = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(steps)])
    local = Rotation.random(len(times) * 13, random_state=seed).as_quat().reshape(-1, 13, 4)
    observed = random.random((len(times), 13)) >= unseen
    rotations, mask = live(times, local, observed, noisy=noisy)
    got, seen = on_grid(times, local, without_jumps(local, observed) if noisy else observed)
    np.testing.assert_array_equal(seen, mask)
    np.testing.assert_allclose(got, rotations, atol=1e-6)


def test_numbers_are_those_of_the_service() -> None:
    assert resample.INTERPOLATE_S == timeline.INTERPOLATE_S
    assert resample.SAME_INSTANT_S == timeline.SAME_INSTANT_S
    assert (resample.JUMP_RAD, resample.JUMPS_BELIEVED) == (JUMP_RAD, JUMPS_BELIEVED)


def test_phases_lie_between_the_frames() -> None:
    times = np.arange(121) / 120.0
    angle = np.linspace(0.0, 60.0, 121)
    local = np.tile([0.0, 0.0, 0.0, 1.0], (121, 13, 1))
    local[:, 3] = Rotation.from_rotvec(np.outer(np.radians(angle), [0, 0, 1])).as_quat()
    observed = np.ones((121, 13), np.bool_)
    for phase in range(4):
        rotations, _ = on_grid(times, local, observed, phase_s=phase / 120.0)
        turned = np.degrees(Rotation.from_quat(rotations[:, 3]).as_rotvec()[:, 2])
        assert len(rotations) == (31 if phase == 0 else 30)
        np.testing.assert_allclose(turned, angle[phase::4], atol=1e-4)


def test_one_pose_is_one_frame_and_a_phase_past_the_end_is_none() -> None:
    one = np.tile([0.0, 0.0, 0.0, 1.0], (1, 13, 1))
    assert len(on_grid(np.zeros(1), one, np.ones((1, 13), np.bool_))[0]) == 1
    assert len(on_grid(np.zeros(1), one, np.ones((1, 13), np.bool_), phase_s=0.01)[0]) == 0
