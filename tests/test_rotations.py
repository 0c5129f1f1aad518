"""Rotations against scipy, and the promise that a row's bits never depend on its neighbours."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from fervor import rotations as rot

Array = npt.NDArray[np.float64]
HALF = np.sqrt(0.5)
EDGES = np.array(
    [
        [0, 0, 0, 1], [0, 0, 0, -1], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, -1, 0],
        [HALF, 0, 0, HALF], [0, HALF, 0, HALF], [0, -HALF, 0, HALF], [0, 0, -HALF, HALF],
        [0.5, 0.5, -0.5, 0.5], [0.5, 0.5, 0.5, 0.5], [-0.5, 0.5, 0.5, -0.5],
        [HALF, HALF, 0, 0], [HALF, 0, HALF, 0], [0, HALF, -HALF, 0], [1e-9, 0, 0, 1], [1, 1e-9, 0, -1e-9],
    ]
)  # fmt: skip
EDGES = EDGES / np.linalg.norm(EDGES, axis=1, keepdims=True)

numbers = st.floats(-1, 1, allow_subnormal=False)
quaternions = (
    arrays(np.float64, 4, elements=numbers)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(lambda q: q / np.linalg.norm(q))
) | st.sampled_from(list(EDGES))
vectors = arrays(np.float64, 3, elements=st.floats(-10, 10, allow_subnormal=False))
many = settings(max_examples=300, deadline=None)


def random_rotations(count: int, seed: int = 0) -> Array:
    q = np.random.default_rng(seed).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def same(a: Array, b: Array, tolerance: float = 1e-12) -> bool:
    """Equal as rotations: q ≡ -q."""
    return bool(np.all(np.minimum(np.abs(a - b).max(axis=-1), np.abs(a + b).max(axis=-1)) < tolerance))


@many
@given(quaternions, quaternions, vectors)
def test_products_and_turned_vectors_agree_with_scipy(a: Array, b: Array, v: Array) -> None:
    assert same(rot.multiply(a, b), (Rotation.from_quat(a) * Rotation.from_quat(b)).as_quat())
    assert np.allclose(rot.rotate(a, v), Rotation.from_quat(a).apply(v), atol=1e-12)
    assert same(rot.multiply(a, rot.conjugate(a)), np.array([0.0, 0, 0, 1]))


@many
@given(quaternions)
def test_matrices_agree_with_scipy_and_come_back(q: Array) -> None:
    assert np.allclose(rot.to_matrix(q), Rotation.from_quat(q).as_matrix(), atol=1e-14)
    assert same(rot.from_matrix(rot.to_matrix(q)), q)


@many
@given(quaternions)
def test_rotation_vectors_agree_with_scipy_and_come_back(q: Array) -> None:
    vector = rot.to_rotvec(q)
    assert np.linalg.norm(vector) <= np.pi + 1e-12
    assert same(rot.from_rotvec(vector), q)
    assert same(Rotation.from_rotvec(vector).as_quat(), q)


@many
@given(vectors)
def test_any_rotation_vector_is_understood(vector: Array) -> None:
    assert same(rot.from_rotvec(vector), Rotation.from_rotvec(vector).as_quat())


@many
@given(st.text("XYZ", max_size=6), st.lists(st.floats(-720, 720), min_size=6, max_size=6))
def test_euler_angles_of_any_order_agree_with_a_product_of_turns(order: str, angles: list[float]) -> None:
    expected = Rotation.identity()
    for axis, angle in zip(order, angles, strict=False):
        expected = expected * Rotation.from_euler(axis.lower(), angle, degrees=True)
    values = np.array(angles[: len(order)])
    assert same(rot.from_euler(order, values), expected.as_quat())
    assert same(rot.from_euler(order, np.radians(values), degrees=False), expected.as_quat())


@pytest.mark.parametrize(("order", "count"), [("XYW", 3), ("xyz", 3), ("XYZ", 2)])
def test_an_impossible_euler_order_is_refused(order: str, count: int) -> None:
    with pytest.raises(ValueError, match="does not fit"):
        rot.from_euler(order, np.zeros(count))


@many
@given(quaternions)
def test_roll_pitch_yaw_is_the_rotation_everywhere(q: Array) -> None:
    roll, pitch, yaw = rot.to_rpy(q)
    assert abs(pitch) <= np.pi / 2 + 1e-12
    assert abs(roll) <= np.pi + 1e-12
    assert abs(yaw) <= np.pi + 1e-12
    assert same(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(), q, 1e-9)


def test_roll_pitch_yaw_equals_scipy_and_formula_7() -> None:
    q = random_rotations(5000)
    rpy = rot.to_rpy(q)
    assert np.allclose(rpy, Rotation.from_quat(q).as_euler("ZYX")[:, ::-1], atol=1e-12)
    x, y, z, w = q.T
    formula = np.stack(
        [
            np.arctan2(2 * (y * z + w * x), w**2 - x**2 - y**2 + z**2),
            np.arcsin(np.clip(2 * (w * y - x * z), -1, 1)),
            np.arctan2(2 * (x * y + w * z), w**2 + x**2 - y**2 - z**2),
        ],
        axis=-1,
    )
    assert np.allclose(rpy, formula, atol=1e-11)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("away", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_roll_pitch_yaw_at_gimbal_lock(sign: float, away: float) -> None:
    rng = np.random.default_rng(3)
    angles = np.stack([rng.uniform(-3, 3, 200), np.full(200, sign * (np.pi / 2 - away)), rng.uniform(-3, 3, 200)], 1)
    q = Rotation.from_euler("ZYX", angles).as_quat()
    rpy = rot.to_rpy(q)
    assert np.allclose(rpy[:, 1], angles[:, 1], atol=1e-7)
    assert same(Rotation.from_euler("ZYX", rpy[:, ::-1]).as_quat(), q, 1e-12)
    if away == 0.0:
        assert np.all(rot.to_rpy(np.array([0.0, sign * HALF, 0.0, HALF]))[[0, 2]] == 0.0)


@many
@given(quaternions)
def test_a_quaternion_and_its_negative_are_one_rotation(q: Array) -> None:
    turn = Rotation.from_quat(q)
    for function in (rot.to_matrix, rot.to_rotvec, rot.to_rpy):
        first, second = function(q), function(-q)
        if function is rot.to_rotvec and turn.magnitude() > np.pi - 1e-9:
            continue  # half a turn has two rotation vectors
        if function is rot.to_rpy:
            first, second = (
                rot.from_euler("ZYX", first[::-1], degrees=False),
                rot.from_euler("ZYX", second[::-1], degrees=False),
            )
            assert same(first, second)
        else:
            assert np.allclose(first, second, atol=1e-9)


@many
@given(quaternions, quaternions)
def test_angles_between_agree_with_scipy(a: Array, b: Array) -> None:
    expected = (Rotation.from_quat(a).inv() * Rotation.from_quat(b)).magnitude()
    assert rot.angle_between(a, b) == pytest.approx(expected, abs=1e-12)
    assert rot.angle_between(a, -b) == pytest.approx(expected, abs=1e-12)
    assert rot.angle_between(a, a) == rot.angle_between(a, -a) == 0.0


def test_tiny_angles_are_not_rounded_away() -> None:
    a = np.array([0.0, 0, 0, 1])
    b = rot.from_rotvec(np.array([3e-9, 0.0, 0.0]))
    assert rot.angle_between(a, b) == pytest.approx(3e-9, rel=1e-6)


@many
@given(quaternions, quaternions, st.floats(0, 1))
def test_slerp_agrees_with_scipy(a: Array, b: Array, fraction: float) -> None:
    got = rot.slerp(a, b, fraction)
    assert np.linalg.norm(got) == pytest.approx(1.0, abs=1e-12)
    if rot.angle_between(a, b) < np.pi - 1e-6:  # there the shortest way is one
        expected = Slerp([0.0, 1.0], Rotation.from_quat([a, b]))(fraction).as_quat()
        assert same(got, expected, 1e-9)
    assert rot.angle_between(a, got) == pytest.approx(fraction * rot.angle_between(a, b), abs=1e-9)


@many
@given(quaternions, quaternions)
def test_slerp_ends_are_exact(a: Array, b: Array) -> None:
    assert rot.slerp(a, b, 0.0).tobytes() == a.tobytes()
    end = rot.slerp(a, b, 1.0)
    assert np.array_equal(end, b) or np.array_equal(end, -b)
    assert np.allclose(rot.slerp(a, -a, 0.5), a)


def test_slerp_takes_a_fraction_per_row() -> None:
    a, b = random_rotations(5, 1), random_rotations(5, 2)
    fractions = np.linspace(0, 1, 5)
    rows = np.stack([rot.slerp(a[i], b[i], float(fractions[i])) for i in range(5)])
    assert np.array_equal(rot.slerp(a, b, fractions), rows)


@given(st.lists(st.tuples(quaternions, quaternions, st.sampled_from([0.0, 0.25, 0.7, 1.0])), min_size=2, max_size=8))
@settings(max_examples=200, deadline=None)
def test_slerp_and_its_angle_are_the_same_in_any_company(pairs: list[tuple[Array, Array, float]]) -> None:
    """What is left out where nobody needs it: turned away, equal, at an end of the way."""
    a, b, fraction = (np.array(each) for each in zip(*pairs, strict=True))
    b[0] = a[0]  # of no angle
    way, angle = rot.slerp(a, b, fraction), rot.angle_between(a, b)
    for row in range(len(pairs)):
        one = slice(row, row + 1)
        assert rot.slerp(a[one], b[one], fraction[one]).tobytes() == way[one].tobytes()
        assert rot.angle_between(a[one], b[one]).tobytes() == angle[one].tobytes()


@given(st.lists(st.one_of(quaternions, st.just(np.zeros(4))), min_size=2, max_size=8))
@settings(max_examples=200, deadline=None)
def test_unit_length_is_the_same_beside_a_zero(q: list[Array]) -> None:
    rows = np.array([*q, np.zeros(4)]) * 1.7
    together = rot.normalise(rows)
    assert all(rot.normalise(row[None]).tobytes() == unit.tobytes() for row, unit in zip(rows, together, strict=True))


signed = st.sampled_from([0.0, -0.0, 1.0, -1.0, HALF, -HALF]) | numbers


@many
@given(arrays(np.float64, (4, 3, 5), elements=signed), arrays(np.float64, (4, 3, 5), elements=signed))
def test_few_products_are_those_of_many_to_the_bit(a: Array, b: Array) -> None:
    expected = np.stack(rot.product(a, b))
    assert rot.small_product(a, b).tobytes() == expected.tobytes()
    assert rot.small_product(tuple(a), tuple(b)).tobytes() == expected.tobytes()
    bind = b[:, :1]  # [4, 1, 5], for all
    assert rot.small_product(a, bind).tobytes() == np.stack(rot.product(a, bind)).tobytes()
    assert rot.small_product(bind, a).tobytes() == np.stack(rot.product(bind, a)).tobytes()


@many
@given(quaternions, quaternions)
def test_hemisphere(q: Array, reference: Array) -> None:
    aligned = rot.align_hemisphere(q, reference)
    assert float(np.dot(aligned, reference)) >= -1e-15
    assert np.array_equal(np.abs(aligned), np.abs(q))


@many
@given(vectors, vectors)
def test_the_smallest_turn_between_two_directions(a: Array, b: Array) -> None:
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 1e-3:
        return
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    turn = rot.between(a, b)
    assert np.allclose(rot.rotate(turn, a), b, atol=1e-4 if np.dot(a, b) < -0.999999 else 1e-9)


@pytest.mark.parametrize("direction", [[0.0, 1, 0], [1.0, 0, 0], [0.0, 0, 1], [0.6, 0.8, 0], [0.48, 0.64, 0.6]])
def test_the_turn_between_opposite_directions_is_half_a_turn(direction: list[float]) -> None:
    a = np.array(direction)
    assert np.allclose(rot.rotate(rot.between(a, -a), a), -a, atol=1e-12)


def test_the_turn_from_hanging_arms_to_a_t_pose_is_90_degrees_about_z() -> None:
    down = np.array([0.0, -1.0, 0.0])
    assert np.allclose(rot.between(down, np.array([1.0, 0, 0])), [0, 0, HALF, HALF], atol=1e-15)
    assert np.allclose(rot.between(down, np.array([-1.0, 0, 0])), [0, 0, -HALF, HALF], atol=1e-15)


def test_mean_agrees_with_scipy_and_is_blind_to_signs() -> None:
    rng = np.random.default_rng(5)
    q = (Rotation.from_rotvec(rng.normal(0, 0.3, (3, 50, 3)).reshape(-1, 3))).as_quat().reshape(3, 50, 4)
    signs = rng.choice([-1.0, 1.0], (3, 50, 1))
    for row in range(3):
        expected = Rotation.from_quat(q[row]).mean().as_quat()
        assert same(rot.mean(q * signs)[row], expected, 1e-9)


@many
@given(quaternions, vectors)
def test_mirror_is_conjugation_with_the_reflection(q: Array, v: Array) -> None:
    flip = np.diag([-1.0, 1.0, 1.0])
    assert np.allclose(rot.to_matrix(rot.mirror(q)), flip @ rot.to_matrix(q) @ flip, atol=1e-12)
    assert np.array_equal(rot.mirror(rot.mirror(q)), q)


def test_normalise_leaves_no_zero_quaternion() -> None:
    q = np.array([[0.0, 0, 0, 0], [0, 3, 0, 4], [0, 0, 0, -1e-3]])
    assert np.array_equal(rot.normalise(q), [[0, 0, 0, 1], [0, 0.6, 0, 0.8], [0, 0, 0, -1]])


def test_axis_and_angle() -> None:
    q = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(np.pi / 2))
    assert np.allclose(q, [0, 0, HALF, HALF])


def test_quaternion_orders() -> None:
    q = random_rotations(4)
    wxyz = q[:, [3, 0, 1, 2]]
    assert np.array_equal(rot.to_xyzw(wxyz, "wxyz"), q)
    assert np.array_equal(rot.from_xyzw(q, "wxyz"), wxyz)
    assert np.array_equal(rot.to_xyzw(q, "xyzw"), q)


Q, V, M, FRACTION = "q", "v", "m", "f"
FUNCTIONS: dict[str, tuple[Callable[..., Any], str]] = {
    "length": (rot.length, Q),
    "normalise": (rot.normalise, Q),
    "conjugate": (rot.conjugate, Q),
    "multiply": (rot.multiply, Q + Q),
    "cross": (rot.cross, V + V),
    "rotate": (rot.rotate, Q + V),
    "from_axis_angle": (rot.from_axis_angle, V + FRACTION),
    "from_rotvec": (rot.from_rotvec, V),
    "to_rotvec": (rot.to_rotvec, Q),
    "from_euler": (lambda v: rot.from_euler("YXZ", v), V),
    "to_rpy": (rot.to_rpy, Q),
    "to_matrix": (rot.to_matrix, Q),
    "from_matrix": (rot.from_matrix, M),
    "between": (rot.between, V + V),
    "align_hemisphere": (rot.align_hemisphere, Q + Q),
    "angle_between": (rot.angle_between, Q + Q),
    "slerp": (rot.slerp, Q + Q + FRACTION),
    "mirror": (rot.mirror, Q),
}


def _arguments(kinds: str, count: int, dtype: npt.DTypeLike) -> list[npt.NDArray[Any]]:
    made: list[npt.NDArray[Any]] = []
    for seed, kind in enumerate(kinds):
        q = np.concatenate([EDGES[:: seed + 1], random_rotations(count, seed)])[:count]
        rng = np.random.default_rng(seed)
        unit = q[:, :3] + 0.1
        choices = {
            Q: q,
            V: unit / np.linalg.norm(unit, axis=1, keepdims=True),
            M: Rotation.from_quat(q).as_matrix(),
            FRACTION: rng.choice([0.0, 1.0, *rng.uniform(size=4)], count),
        }
        made.append(choices[kind].astype(dtype))
    return made


def _spread(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The same values with gaps between rows and between components."""
    wide = np.full([2 * size for size in array.shape], 7.0, array.dtype)
    view = wide[tuple(slice(1, None, 2) for _ in array.shape)]
    view[...] = array
    return view


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_row_never_depends_on_its_batch(name: str, dtype: npt.DTypeLike) -> None:
    function, kinds = FUNCTIONS[name]
    full = _arguments(kinds, 40, dtype)
    expected = [function(*(argument[row] for argument in full)) for row in range(40)]
    assert np.asarray(expected[0]).dtype == dtype
    layouts: list[Callable[[npt.NDArray[Any]], npt.NDArray[Any]]] = [
        np.ascontiguousarray, np.asfortranarray, _spread, lambda a: a[::-1].copy()[::-1],
    ]  # fmt: skip
    for size in range(1, 41):
        start = (7 * size) % (41 - size)
        for layout in layouts:
            result = function(*(layout(argument[start : start + size]) for argument in full))
            for row in range(size):
                assert result[row].tobytes() == np.asarray(expected[start + row]).tobytes(), (size, row)
    grid = function(*(argument.reshape(8, 5, *argument.shape[1:]) for argument in full))
    assert np.asarray(grid).tobytes() == np.asarray(expected).tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_empty_batches_stay_empty(dtype: npt.DTypeLike) -> None:
    for function, kinds in FUNCTIONS.values():
        result = function(*(argument[:0] for argument in _arguments(kinds, 1, dtype)))
        assert result.shape[0] == 0
        assert result.dtype == dtype
