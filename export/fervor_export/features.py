"""What the network sees of a pose: numbers per joint, computed inside the network and inside the model file alike.

Rules: a joint counts as observed where its mask is above one half and its quaternion has a norm between 1/2 and 2; an
unobserved joint gives zeros, whatever its numbers are. q and -q give the same features, to the bit. Every value and
every gradient is finite, at gimbal lock, at half turns and for zero quaternions too.

All features are sums of products of two quaternion components. The sums are tables here, so that `network` (torch) and
`graph` (ONNX) evaluate the same ones. Features are laid out by joint: joint 0's, then joint 1's, and so on.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from fervor.skeletons.rig import JOINTS

FeatureSet = Literal["euler", "rot6d+velocity"]

PER_JOINT: Mapping[FeatureSet, int] = {"euler": 3, "rot6d+velocity": 10}
"""Numbers per joint: roll, pitch, yaw | two matrix columns (6), angular velocity (3), observed (1)."""

SMALLEST_NORM2, LARGEST_NORM2 = 0.25, 4.0
"""Squared norms between which a quaternion is taken for a rotation; sensors send zeros for joints they lost."""

VELOCITY_SCALE = 0.1
"""rad/s to feature: a quick gesture (10 rad/s) becomes 1."""

FADE = 4.0
"""sign(w) is taken as w · FADE between -1 and 1: without a jump at half turns, and the same number for q and -q."""

LOCK = 1e-8
"""Gimbal lock: where cos² of the middle angle is at most this, roll is set to 0 and yaw takes the whole turn."""

_COMPONENTS = "xyzw"

PAIRS: tuple[str, ...] = ("xx", "yy", "zz", "ww", "xy", "xz", "yz", "xw", "yw", "zw")
"""The ten products of two components of one quaternion."""

CROSS: tuple[str, ...] = tuple(p + q for p in _COMPONENTS for q in _COMPONENTS)
"""The sixteen products of a component of p and one of q."""


def factors(products: Sequence[str], place: Literal[0, 1]) -> list[int]:
    """Which component is the first or second factor of each product: indices into xyzw."""
    return [_COMPONENTS.index(product[place]) for product in products]


def picks(products: Sequence[str], place: Literal[0, 1]) -> npt.NDArray[np.float32]:
    """`factors` as a matrix [4, product] of zeros and ones.

    A product with it picks exactly, and costs onnxruntime a tenth of a Gather along the last axis.
    """
    return np.eye(4, dtype=np.float32)[:, factors(products, place)]


def _table(products: Sequence[str], sums: Sequence[str]) -> npt.NDArray[np.float32]:
    """Signed sums such as "+ww -xx" as a matrix [product, sum]."""
    table = np.zeros((len(products), len(sums)), np.float32)
    for column, terms in enumerate(sums):
        for term in terms.split():
            table[products.index(term[1:]), column] = 1.0 if term[0] == "+" else -1.0
    return table


ROT6D: npt.NDArray[np.float32] = _table(
    PAIRS, ("+ww +xx -yy -zz", "+xy +zw", "+xz -yw", "+xy -zw", "+ww -xx +yy -zz", "+yz +xw")
) * np.asarray([1, 2, 2, 2, 1, 2], np.float32)
"""[10, 6]: first and second column of the rotation matrix of a unit quaternion (Zhou et al. 2019)."""

RELATIVE: npt.NDArray[np.float32] = _table(
    CROSS, ("+wx -xw -yz +zy", "+wy -yw -zx +xz", "+wz -zw -xy +yx", "+ww +xx +yy +zz")
)
"""[16, 4]: p^-1 q of unit quaternions, from the products of `CROSS`."""

EULER_SUMS: tuple[str, ...] = (
    "+yz +xw",  # sine part of roll, half
    "+yw -xz",  # sine of pitch, half
    "+xy +zw",  # sine part of yaw, half
    "+zw -xy",  # the same at gimbal lock, half
    "+ww -xx -yy +zz",  # cosine part of roll
    "+ww +xx -yy -zz",  # cosine part of yaw
    "+ww -xx +yy -zz",  # the same at gimbal lock
    "+ww +xx +yy +zz",  # squared norm
)
"""Terms of the roll-pitch-yaw formula R = Rz(yaw) Ry(pitch) Rx(roll)."""


def euler_terms() -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """`EULER_SUMS` as [term, sum] indices into `PAIRS` and [term, sum] factors, four terms each.

    They are added one after the other, not by a matrix product: near a half turn the sign of a sum decides between +π
    and -π, so torch and onnxruntime must round alike.
    """
    index = np.zeros((4, len(EULER_SUMS)), np.int64)
    factor = np.zeros((4, len(EULER_SUMS)), np.float32)
    for column, terms in enumerate(EULER_SUMS):
        half = len(terms.split()) == 2
        for row, term in enumerate(terms.split()):
            index[row, column] = PAIRS.index(term[1:])
            factor[row, column] = (1.0 if term[0] == "+" else -1.0) * (2.0 if half else 1.0)
    return index, factor


def observed(rotations: Tensor, mask: Tensor) -> Tensor:
    """Which joints count: bool [..., 13] from rotations [..., 13, 4] xyzw and mask [..., 13]."""
    norm2 = rotations.square().sum(-1)
    return (mask > 0.5) & (norm2 >= SMALLEST_NORM2) & (norm2 <= LARGEST_NORM2)  # a NaN fails both


def euler(rotations: Tensor, mask: Tensor) -> Tensor:
    """The paper's features: roll, pitch, yaw of each joint, radians (section III-A).

    Args:
        rotations: [..., 13, 4] xyzw.
        mask: [..., 13], 1 observed.

    Returns:
        [..., 39]; roll and yaw in [-π, π], pitch in [-π/2, π/2].
    """
    seen = observed(rotations, mask)
    q = torch.where(seen.unsqueeze(-1), rotations, torch.zeros_like(rotations))
    products = q[..., factors(PAIRS, 0)] * q[..., factors(PAIRS, 1)]  # [..., 13, 10]
    index, factor = euler_terms()
    terms = [products[..., torch.from_numpy(i)] * torch.from_numpy(f).to(q) for i, f in zip(index, factor, strict=True)]
    roll_y, pitch_y, yaw_y, lock_y, roll_x, yaw_x, lock_x, norm2 = (
        ((terms[0] + terms[1]) + terms[2]) + terms[3]
    ).unbind(-1)
    cos2 = yaw_x * yaw_x + yaw_y * yaw_y
    lock = cos2 <= norm2 * norm2 * LOCK
    # Pitch by atan2 as well: the arcsine loses half the digits near ±90°, and its slope is infinite there.
    pitch_x = torch.where(lock, cos2.detach().sqrt(), torch.where(lock, torch.ones_like(cos2), cos2).sqrt())
    roll = torch.where(lock, torch.zeros_like(roll_y), _atan2(roll_y, roll_x))
    yaw = _atan2(torch.where(lock, lock_y, yaw_y), torch.where(lock, lock_x, yaw_x))
    return torch.stack([roll, _atan2(pitch_y, pitch_x), yaw], -1).flatten(-2)


def _atan2(y: Tensor, x: Tensor) -> Tensor:
    """atan2 whose gradient at the origin is zero instead of NaN."""
    origin = (x == 0) & (y == 0)
    return torch.where(origin, torch.zeros_like(y), torch.atan2(y, torch.where(origin, torch.ones_like(x), x)))


def rot6d_velocity(rotations: Tensor, mask: Tensor, previous: Tensor, *, rate_hz: float) -> tuple[Tensor, Tensor]:
    """Two rotation-matrix columns, angular velocity and the mask, for each joint.

    The velocity is 2 vec(p^-1 q) · sign(w) · rate, which is the angular velocity in the child's frame for small steps.
    It is zero where this frame or the one before did not see the joint, and fades to zero for steps from 151° to 180°,
    whose direction is ill-defined.

    Args:
        rotations: [batch, time, 13, 4] xyzw.
        mask: [batch, time, 13], 1 observed.
        previous: [batch, 13, 4], unit quaternions of the frame before; zero quaternions for joints not seen then.
        rate_hz: frames a second.

    Returns:
        Features [batch, time, 130], and the next `previous`.
    """
    seen = observed(rotations, mask).unsqueeze(-1)  # [batch, time, 13, 1]
    norm = rotations.square().sum(-1, keepdim=True).clamp(SMALLEST_NORM2, LARGEST_NORM2).sqrt()
    zero = torch.zeros_like(rotations)
    q = torch.where(seen, torch.where(seen, rotations, zero) / torch.where(seen, norm, torch.ones_like(norm)), zero)
    columns = (q[..., factors(PAIRS, 0)] * q[..., factors(PAIRS, 1)]) @ torch.from_numpy(ROT6D).to(q)  # [.., 13, 6]
    p = torch.cat([previous.unsqueeze(1), q[:, :-1]], 1)
    table = torch.from_numpy(relative_scaled(rate_hz)).to(q)
    relative = (p[..., factors(CROSS, 0)] * q[..., factors(CROSS, 1)]) @ table  # [batch, time, 13, 6]
    velocity = relative[..., :3] * relative[..., 3:].clamp(-1.0, 1.0)
    return torch.cat([columns, velocity, seen.to(q)], -1).flatten(-2), q[:, -1]


def relative_scaled(rate_hz: float) -> npt.NDArray[np.float32]:
    """`RELATIVE` in feature units: [16, 6], three columns 2 · rate · scale · vec, then w · `FADE` three times."""
    vector = RELATIVE[:, :3] * np.float32(2.0 * rate_hz * VELOCITY_SCALE)
    w = RELATIVE[:, 3:] * np.float32(FADE)
    return np.concatenate([vector, w, w, w], axis=1)


def width(features: FeatureSet) -> int:
    """Numbers per frame: 39 or 130."""
    return PER_JOINT[features] * len(JOINTS)
