"""Walking: the curves have the shape and size of normal gait."""

import numpy as np

from fervor_export.synthetic.gait import arm_swing, legs, trunk

PHASE = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
ONE = np.ones(200)


def test_hip_and_knee_move_as_in_normal_gait() -> None:
    hip, knee = legs(PHASE, ONE)
    assert 28.0 < hip.max() < 36.0
    assert -14.0 < hip.min() < -8.0
    assert 55.0 < knee.max() < 65.0
    assert 0.0 < knee.min() < 8.0
    stance = knee[:80, 0]
    assert 14.0 < stance.max() < 22.0  # the knee yields after heel strike
    assert np.allclose(hip[:, 0], np.roll(hip[:, 1], 100), atol=1e-6)


def test_longer_steps_swing_further() -> None:
    for part in (0, 1):
        long, short = (legs(PHASE, stride * ONE)[part] for stride in (1.3, 0.7))
        assert np.ptp(long) > np.ptp(short)


def test_arms_swing_against_the_legs() -> None:
    hip, arm = legs(PHASE, ONE)[0], arm_swing(PHASE)
    for side in (0, 1):
        assert np.corrcoef(hip[:, side], arm[:, side])[0, 1] < -0.7


def test_the_trunk_nods_twice_a_stride() -> None:
    yaw, roll, pitch = trunk(PHASE, ONE)
    spectra = [np.abs(np.fft.rfft(wave)).argmax() for wave in (yaw, roll, pitch)]
    assert spectra == [1, 1, 2]
