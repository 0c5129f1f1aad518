"""Rotations as unit quaternions, batched: arrays [..., 4] in the order x, y, z, w.

Rules. Every function works on any leading axes and keeps the caller's dtype (float32 or float64). Arithmetic is
elementwise in a fixed order, never matmul, einsum or a reduction over components: a row's bits don't depend on its
batch neighbours, the batch's length or its memory layout. q and -q are the same rotation, and no function takes them
for different ones. `multiply(a, b)` turns by b first, then by a, as matrices do. Angles are radians unless a parameter
says degrees. Formulas by number: docs, "Skeletons and rotations".
"""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

F = TypeVar("F", bound=np.floating[Any])

IDENTITY: npt.NDArray[np.float64] = np.array([0.0, 0.0, 0.0, 1.0])
IDENTITY.setflags(write=False)

_AXIS = {"X": 0, "Y": 1, "Z": 2}


def _parts(array: npt.NDArray[Any]) -> tuple[Any, ...]:
    """Views on the components along the last axis."""
    return tuple(array[..., index] for index in range(array.shape[-1]))


def _join(*parts: Any) -> npt.NDArray[Any]:
    """Components, all of one shape, as the last axis of a new C-ordered array."""
    joined = np.empty((*parts[0].shape, len(parts)), parts[0].dtype)
    for index, part in enumerate(parts):
        joined[..., index] = part
    return joined


def dot(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> Any:
    """Dot products [...] over the last axis, summed in one order: np.sum's order depends on the memory layout."""
    products = a * b
    total = products[..., 0] + products[..., 1]
    for index in range(2, products.shape[-1]):
        total += products[..., index]
    return total


def identity(shape: tuple[int, ...] = (), dtype: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
    """Identity rotations [*shape, 4]."""
    q = np.zeros((*shape, 4), dtype)
    q[..., 3] = 1.0
    return q


def length(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Euclidean length [...] of quaternions or vectors [..., n]."""
    norm: npt.NDArray[F] = np.sqrt(dot(q, q))
    return norm


def normalise(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Quaternions [..., 4] at unit length; a zero quaternion, which is no rotation, becomes the identity."""
    norm = length(q)
    zero = norm == 0.0
    if not zero.any():
        unit: npt.NDArray[F] = np.divide(q, norm[..., None], order="C")
        return unit
    x, y, z, w = _parts(q)
    divisor = np.where(zero, norm.dtype.type(1.0), norm)
    return _join(x / divisor, y / divisor, z / divisor, np.where(zero, norm.dtype.type(1.0), w / divisor))


def conjugate(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Inverse rotations of unit quaternions [..., 4]."""
    x, y, z, w = _parts(q)
    return _join(-x, -y, -z, w)


def multiply(a: npt.NDArray[F], b: npt.NDArray[F]) -> npt.NDArray[F]:
    """Products a·b of quaternions [..., 4], leading axes broadcast: first b, then a."""
    return _join(*product(_parts(a), _parts(b)))


def product(a: Iterable[Any], b: Iterable[Any]) -> tuple[Any, Any, Any, Any]:
    """`multiply` for quaternions kept as four arrays x, y, z, w: twice as fast where several products follow."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


_PLACES = np.array([[3, 2, 1, 0], [2, 3, 0, 1], [1, 0, 3, 2], [0, 1, 2, 3]])
"""Which component of b meets each of a (row) in each of a·b (column)."""
_SIGNS = np.array([[1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [-1.0, 1.0, 1.0, -1.0], [1.0, 1.0, 1.0, 1.0]])


def small_product(a: Iterable[Any], b: Iterable[Any]) -> npt.NDArray[Any]:
    """`product` [4, ...] to the bit, in a quarter of its calls: twice as fast for a few rotations, slower for many."""
    left, right = np.asarray(a), np.asarray(b)
    terms = right.take(_PLACES, axis=0)  # [of a, of a·b, ...]
    terms *= _SIGNS.reshape(4, 4, *(1,) * (right.ndim - 1))
    terms = left[:, None] * terms
    total: npt.NDArray[Any] = terms[3] + terms[0]
    total += terms[1]
    total += terms[2]
    return total


def cross(a: npt.NDArray[F], b: npt.NDArray[F]) -> npt.NDArray[F]:
    """Cross products of vectors [..., 3], leading axes broadcast."""
    ax, ay, az = _parts(a)
    bx, by, bz = _parts(b)
    return _join(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def rotate(q: npt.NDArray[F], vector: npt.NDArray[F]) -> npt.NDArray[F]:
    """Vectors [..., 3] turned by unit quaternions [..., 4], leading axes broadcast."""
    axis = q[..., :3]
    twice = 2.0 * cross(axis, vector)
    turned: npt.NDArray[F] = vector + q[..., 3:] * twice + cross(axis, twice)
    return turned


def from_axis_angle(axis: npt.NDArray[F], angle: npt.NDArray[F]) -> npt.NDArray[F]:
    """Turns by `angle` [...] about unit vectors `axis` [..., 3]."""
    half = np.asarray(angle) * 0.5
    sine = np.sin(half)
    x, y, z = _parts(axis)
    return _join(x * sine, y * sine, z * sine, np.broadcast_to(np.cos(half), np.shape(x * sine)))


def from_rotvec(vector: npt.NDArray[F]) -> npt.NDArray[F]:
    """Rotation vectors [..., 3] (axis times angle) as quaternions [..., 4]."""
    angle = length(vector)
    small = angle < 1e-3
    safe = np.where(small, angle.dtype.type(1.0), angle)
    scale = np.where(small, 0.5 - angle * angle / 48.0, np.sin(0.5 * safe) / safe)
    x, y, z = _parts(vector)
    return _join(x * scale, y * scale, z * scale, np.cos(0.5 * angle))


def to_rotvec(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Rotation vectors [..., 3] of unit quaternions, their length from 0 to π (at π either sign is right)."""
    x, y, z, w = _parts(q)
    sign = np.where(w < 0.0, w.dtype.type(-1.0), w.dtype.type(1.0))
    sine = length(q[..., :3])
    small = sine < 1e-12
    safe = np.where(small, sine.dtype.type(1.0), sine)
    scale = sign * np.where(small, sine.dtype.type(2.0), 2.0 * np.arctan2(sine, sign * w) / safe)
    return _join(x * scale, y * scale, z * scale)


def from_euler(order: str, angles: npt.NDArray[F], *, degrees: bool = True) -> npt.NDArray[F]:
    """Turns about moving axes, one after the other (intrinsic): R = R_first · R_second and so on.

    Args:
        order: axes in the order in which a BVH lists its channels, such as "YXZ"; any length, also empty.
        angles: [..., len(order)].
        degrees: False for radians.

    Raises:
        ValueError: an axis other than X, Y, Z, or another number of angles.
    """
    if angles.shape[-1] != len(order) or not set(order) <= _AXIS.keys():
        raise ValueError(f"order {order!r} does not fit {angles.shape[-1]} angles about X, Y or Z")
    half = angles * (np.pi / 360.0 if degrees else 0.5)
    sine, cosine = np.sin(half), np.cos(half)
    q = identity(angles.shape[:-1], angles.dtype)
    for index, axis in enumerate(order):
        turn = np.zeros_like(q)
        turn[..., _AXIS[axis]] = sine[..., index]
        turn[..., 3] = cosine[..., index]
        q = multiply(q, turn) if index else turn
    return q


def to_rpy(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Roll, pitch, yaw [..., 3] = [a, b, c] with R = Rz(c) Ry(b) Rx(a): the paper's features (formula 7).

    a and c lie in [-π, π], b in [-π/2, π/2]. Computed from half sums and half differences of a and c, so that angles
    stay exact to the last digits beside gimbal lock; at the lock itself a is 0.
    """
    x, y, z, w = _parts(q)
    minus_sin, minus_cos = z - x, w + y  # of (c - a) / 2, times cos(b/2) + sin(b/2)
    plus_sin, plus_cos = z + x, w - y  # of (c + a) / 2, times cos(b/2) - sin(b/2)
    minus, plus = np.arctan2(minus_sin, minus_cos), np.arctan2(plus_sin, plus_cos)
    minus_size = np.sqrt(minus_sin * minus_sin + minus_cos * minus_cos)
    plus_size = np.sqrt(plus_sin * plus_sin + plus_cos * plus_cos)
    locked = 8.0 * np.finfo(q.dtype).eps
    up, down = plus_size < locked, minus_size < locked  # b = +90°, b = -90°
    roll = np.where(up | down, plus.dtype.type(0.0), plus - minus)
    yaw = np.where(up, 2.0 * minus, np.where(down, 2.0 * plus, plus + minus))
    return _join(_wrap(roll), 2.0 * np.arctan2(minus_size, plus_size) - np.pi / 2.0, _wrap(yaw))


def _wrap(angle: Any) -> Any:
    """Angles from -2π..2π in -π..π."""
    return np.where(angle > np.pi, angle - 2.0 * np.pi, np.where(angle < -np.pi, angle + 2.0 * np.pi, angle))


def to_matrix(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Rotation matrices [..., 3, 3] of unit quaternions."""
    x, y, z, w = _parts(q)
    xx, yy, zz, xy, xz, yz, wx, wy, wz = x * x, y * y, z * z, x * y, x * z, y * z, w * x, w * y, w * z
    rows = _join(
        1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy),
        2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
        2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy),
    )  # fmt: skip
    return rows.reshape(*q.shape[:-1], 3, 3)


def from_matrix(matrix: npt.NDArray[F]) -> npt.NDArray[F]:
    """Unit quaternions [..., 4] of rotation matrices [..., 3, 3] (right-handed: a reflection gives nonsense).

    The matrix gives 4·q·qᵀ; its row with the largest diagonal, normalised, is q (Shepperd's method).
    """
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = _parts(matrix.reshape(*matrix.shape[:-2], 9))
    xy, xz, yz, xw, yw, zw = m01 + m10, m02 + m20, m12 + m21, m21 - m12, m02 - m20, m10 - m01
    diagonal = _join(1.0 + m00 - m11 - m22, 1.0 - m00 + m11 - m22, 1.0 - m00 - m11 + m22, 1.0 + m00 + m11 + m22)
    xx, yy, zz, ww = _parts(diagonal)
    outer = _join(xx, xy, xz, xw, xy, yy, yz, yw, xz, yz, zz, zw, xw, yw, zw, ww)
    outer = outer.reshape(*diagonal.shape[:-1], 4, 4)
    largest = diagonal.argmax(axis=-1)[..., None, None]
    return normalise(np.take_along_axis(outer, largest, axis=-2)[..., 0, :])


def to_xyzw(q: npt.NDArray[F], order: str) -> npt.NDArray[F]:
    """Quaternions [..., 4] given in `order` ("xyzw" or "wxyz"), in our order."""
    return q if order == "xyzw" else np.roll(q, -1, axis=-1)


def from_xyzw(q: npt.NDArray[F], order: str) -> npt.NDArray[F]:
    """Our quaternions [..., 4] in `order` ("xyzw" or "wxyz")."""
    return q if order == "xyzw" else np.roll(q, 1, axis=-1)


def between(a: npt.NDArray[F], b: npt.NDArray[F]) -> npt.NDArray[F]:
    """The smallest turns that take unit vectors a to unit vectors b, both [..., 3].

    Opposite vectors leave the axis open: then a half turn about what of Z is across them, or about X where they lie
    along Z.
    """
    ax, ay, az = _parts(a)
    x, y, z = _parts(cross(a, b))
    w = 1.0 + dot(a, b)
    opposite = w < 1e-9
    along_z = ax * ax + ay * ay < 1e-9
    one, zero = w.dtype.type(1.0), w.dtype.type(0.0)
    x = np.where(opposite, np.where(along_z, one, -az * ax), x)
    y = np.where(opposite, np.where(along_z, zero, -az * ay), y)
    z = np.where(opposite, np.where(along_z, zero, ax * ax + ay * ay), z)
    return normalise(_join(x, y, z, np.where(opposite, zero, w)))


def align_hemisphere(q: npt.NDArray[F], reference: npt.NDArray[F]) -> npt.NDArray[F]:
    """The same rotations [..., 4], each as the one of q and -q that is nearer to `reference` (ties: q)."""
    flip = dot(q, reference) < 0.0
    return np.where(flip[..., None], -q, q)


def _turned_to(q: npt.NDArray[F], reference: npt.NDArray[F]) -> npt.NDArray[F]:
    """`align_hemisphere`, or `q` itself where none of it has to be turned, as is usual."""
    flip = dot(q, reference) < 0.0
    return np.where(flip[..., None], -q, q) if flip.any() else q


def angle_between(a: npt.NDArray[F], b: npt.NDArray[F]) -> npt.NDArray[F]:
    """Angle [...] from 0 to π of the turn between unit quaternions a and b, exact for small and large angles."""
    b = _turned_to(b, a)
    angle: npt.NDArray[F] = 4.0 * np.arctan2(length(a - b), length(a + b))
    return angle


def slerp(a: npt.NDArray[F], b: npt.NDArray[F], fraction: npt.NDArray[F] | float) -> npt.NDArray[F]:
    """Rotations on the shortest way from a to b, at constant speed.

    Args:
        a: unit quaternions [..., 4].
        b: unit quaternions [..., 4]; -b gives the same way.
        fraction: 0 (exactly a) to 1 (exactly b or -b, bit for bit); broadcast against the leading axes.
    """
    b = _turned_to(b, a)
    share = np.asarray(fraction, a.dtype)
    rest = 1.0 - share
    half = 0.5 * length(a - b)  # sine of half the angle between the 4-vectors, which is at most π/2
    angle = 2.0 * np.arcsin(half)
    sine = 2.0 * half * np.sqrt(1.0 - half * half)  # of the whole angle
    left, right = np.sin(rest * angle), np.sin(share * angle)
    near = angle < 1e-6  # the sines cancel there: linear is exact
    if near.any():
        sine = np.where(near, angle.dtype.type(1.0), sine)
        left, right = np.where(near, rest, left), np.where(near, share, right)
    way = (left / sine)[..., None] * a + (right / sine)[..., None] * b
    start, end = share == 0.0, share == 1.0
    return np.where(start[..., None], a, np.where(end[..., None], b, way)) if (start | end).any() else way


def mean(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Mean rotation [..., 4] of unit quaternions [..., n, 4], blind to their signs.

    The eigenvector of Σ q·qᵀ with the largest eigenvalue (Markley et al. 2007; formula 4).
    """
    parts = [np.ascontiguousarray(part) for part in _parts(q)]
    outer = _join(*((a * b).mean(axis=-1) for a in parts for b in parts))
    _, vectors = np.linalg.eigh(outer.reshape(*outer.shape[:-1], 4, 4))
    return normalise(vectors[..., :, -1])


def mirror(q: npt.NDArray[F]) -> npt.NDArray[F]:
    """Rotations [..., 4] seen in a mirror across the plane of Y and Z (formula 6); its own inverse.

    For a whole pose the left and right joints must be swapped too: `skeletons.rig.mirror_pose`.
    """
    x, y, z, w = _parts(q)
    return _join(x, -y, -z, w)
