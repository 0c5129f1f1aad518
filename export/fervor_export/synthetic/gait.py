"""Walking: hip and knee over the gait cycle from normative curves, and everything that swings with them.

Curves after Winter 1991 (natural cadence), as Fourier series so that any phase can be asked for; step length and
cadence scale them. Arms swing against the legs.
"""

import numpy as np
import numpy.typing as npt

from fervor_export.synthetic.tracks import Array

Series = npt.NDArray[np.complex128]

_HIP = np.array([30, 28, 24.5, 20.5, 16, 11.5, 7, 2.5, -2, -6, -9.5, -11, -8, 0, 10.5, 20, 27.5, 31.5, 32, 30.5])
_KNEE = np.array([4, 10, 16, 18, 17, 14, 11, 8, 6, 6, 9.5, 19, 34, 50, 60.5, 61, 52, 34.5, 14.5, 4.5])
"""Degrees of flexion every 5 % of the cycle, from heel strike."""


def _series(curve: Array) -> Series:
    """The first six Fourier coefficients of a cycle."""
    return np.fft.rfft(curve)[:7] / len(curve) * np.concatenate(([1.0], np.full(6, 2.0)))


_HIP_SERIES, _KNEE_SERIES = _series(_HIP), _series(_KNEE)


def _evaluate(series: Series, phase: Array) -> Array:
    """The curve [...] at a phase [...] in radians."""
    order = np.arange(len(series))
    waves: Array = np.real(np.exp(1j * phase[..., None] * order) @ series)
    return waves


def legs(phase: Array, stride: Array) -> tuple[Array, Array]:
    """Hip and knee flexion in degrees, [frame, 2] left and right.

    Args:
        phase: [frame] radians, 0 at the left heel strike.
        stride: [frame] length of steps relative to natural ones.
    """
    both = np.stack((phase, phase + np.pi), axis=-1)
    hip, knee = _evaluate(_HIP_SERIES, both), _evaluate(_KNEE_SERIES, both)
    mean = float(_HIP_SERIES[0].real)
    return mean + (hip - mean) * stride[:, None], knee * (0.35 + 0.65 * stride[:, None])


def arm_swing(phase: Array) -> Array:
    """Arm forward (1) or back (-1), [frame, 2] left and right: opposite to the legs."""
    both = np.stack((phase + np.pi, phase), axis=-1)
    return np.cos(both - 0.35) + 0.12 * np.cos(2.0 * both)


def trunk(phase: Array, stride: Array) -> tuple[Array, Array, Array]:
    """Pelvis yaw, pelvis roll and trunk pitch in degrees, each [frame]."""
    return -6.0 * stride * np.cos(phase), 4.0 * stride * np.sin(phase), 1.3 * stride * np.cos(2.0 * phase + 0.6)
