"""The adapter against an independent implementation of formula 3 with scipy, on the catalogue and on random trees."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fervor.errors import InputError
from fervor.recordings.bvh import read_bvh
from fervor.recordings.recording import rig_poses
from fervor.rotations import IDENTITY, multiply
from fervor.skeletons.adapter import SMALL, adapt
from fervor.skeletons.binds import T_POSE
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS, mirror_pose
from fervor.skeletons.skeleton import ROOT, Skeleton

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.exists() and not os.environ.get("CI"), reason="no real motion here")
FILES = ["100style/angry_reference", "100style/elated_reference", "100style/rushed_reference"] + [
    f"cmu/79_{take}" for take in (69, 70, 71)
]

Array = npt.NDArray[np.float64]


def random_rotations(*shape: int, seed: int = 0) -> Array:
    q = np.random.default_rng(seed).normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def same(a: Array, b: Array, tolerance: float = 1e-12) -> bool:
    return bool(np.all(np.minimum(np.abs(a - b).max(-1), np.abs(a + b).max(-1)) < tolerance))


def globals_of(source: Skeleton, local: Array) -> list[Rotation]:
    """Absolute rotations of one frame, composed along the tree, whatever the order of the joints."""

    def whole(joint: int) -> Rotation:
        turn = Rotation.from_quat(local[joint])
        return turn if source.parents[joint] == ROOT else whole(source.parents[joint]) * turn

    return [whole(joint) for joint in range(len(source.joints))]


def reference(source: Skeleton, frame: Array, axes: str) -> Array:
    """L_j = A_p Q_p^-1 Q_j A_j^-1 for one frame, unseen joints the identity."""
    turns = globals_of(source, frame) if axes == "local" else [Rotation.from_quat(q) for q in frame]
    out = np.tile(IDENTITY, (len(JOINTS), 1))
    for joint in range(len(JOINTS)):
        if not source.sees[joint]:
            continue
        above, below = source.drives[PARENT_SEGMENT[joint]], source.drives[CHILD_SEGMENT[joint]]
        assert above is not None
        assert below is not None
        q_p, q_j = (Rotation.identity() if drive == ROOT else turns[drive] for drive in (above, below))
        a_p = Rotation.from_quat(source.bind[PARENT_SEGMENT[joint]])
        a_j = Rotation.from_quat(source.bind[CHILD_SEGMENT[joint]])
        out[joint] = (a_p * q_p.inv() * q_j * a_j.inv()).as_quat()
    return out


def check(source: Skeleton, rotations: Array, axes: Any) -> None:
    local, observed = adapt(source, rotations, np.ones(rotations.shape[:-1], np.bool_), axes=axes)
    assert local.shape == (*rotations.shape[:-2], 13, 4)
    assert np.array_equal(observed, np.broadcast_to(source.sees, observed.shape))
    for index in np.ndindex(rotations.shape[:-2]):
        assert same(local[index], reference(source, rotations[index], axes))


@pytest.mark.parametrize("axes", ["local", "global"])
@pytest.mark.parametrize("name", SKELETONS)
def test_every_skeleton_agrees_with_formula_3(name: str, axes: str) -> None:
    source = skeleton(name)
    if axes == "global" and source.needs_local:
        return
    check(source, random_rotations(3, 2, len(source.joints), seed=len(name)), axes)


@st.composite
def random_trees(draw: st.DrawFn) -> Skeleton:
    count = draw(st.integers(1, 30))
    parents = tuple(draw(st.integers(ROOT, joint - 1)) for joint in range(count))
    drive = st.none() | st.integers(ROOT, count - 1)
    return Skeleton(
        name="random",
        title="Random",
        joints=tuple(f"j{joint}" for joint in range(count)),
        parents=parents,
        axes="local",
        drives=tuple(draw(st.lists(drive, min_size=14, max_size=14))),
        bind=random_rotations(14, seed=draw(st.integers(0, 999))),
    )


@settings(max_examples=150, deadline=None)
@given(random_trees(), st.integers(0, 999))
def test_random_trees_agree_with_formula_3(source: Skeleton, seed: int) -> None:
    rotations = random_rotations(2, len(source.joints), seed=seed)
    check(source, rotations, "local")
    if not source.needs_local:
        check(source, rotations, "global")


@settings(max_examples=100, deadline=None)
@given(random_trees(), st.integers(0, 999), st.data())
def test_an_untracked_joint_hides_exactly_the_rig_joints_that_pass_it(
    source: Skeleton, seed: int, data: st.DataObject
) -> None:
    rotations = random_rotations(len(source.joints), seed=seed)
    lost = data.draw(st.integers(0, len(source.joints) - 1))
    whole, seen = adapt(source, rotations, np.ones(len(source.joints), np.bool_), axes="local")
    variants = []
    for bad in ([0, 0, 0, 0], [0.1, 0.2, 0.1, 0.3], [np.nan, 0, 0, 1], [1e300, 0, 0, 1], [np.inf, 0, 0, 0]):
        broken = rotations.copy()
        broken[lost] = bad
        variants.append(adapt(source, broken, np.ones(len(source.joints), np.bool_), axes="local"))
    observed = np.ones(len(source.joints), np.bool_)
    observed[lost] = False
    variants.append(adapt(source, rotations, observed, axes="local"))

    # A rig joint passes the lost joint exactly where turning that joint moves it.
    turned = rotations.copy()
    turned[lost] = multiply(rotations[lost], random_rotations(1, seed=seed + 1)[0])
    moved = ~np.isclose(np.abs((adapt(source, turned, np.ones_like(observed), axes="local")[0] * whole).sum(-1)), 1.0)
    for local, still in variants:
        assert np.array_equal(still, seen & ~moved)
        assert np.array_equal(local[~still], np.tile(IDENTITY, ((~still).sum(), 1)))
        assert np.array_equal(local[still], whole[still])


@pytest.mark.parametrize("name", [name for name, source in SKELETONS.items() if not source.needs_local])
def test_where_the_sensor_stands_never_matters(name: str) -> None:
    source = skeleton(name)
    rotations = random_rotations(20, len(source.joints), seed=4)
    observed = np.ones(rotations.shape[:-1], np.bool_)
    still, _ = adapt(source, rotations, observed, axes="global")
    for camera in random_rotations(10, seed=5):
        moved, _ = adapt(source, multiply(camera, rotations), observed, axes="global")
        assert same(moved, still)


def test_the_canonical_rig_passes_unchanged() -> None:
    rotations = random_rotations(7, 13)
    local, observed = adapt(skeleton("c13"), rotations, np.ones((7, 13), np.bool_), axes="local")
    assert same(local, rotations, 1e-15)
    assert observed.all()


def test_global_rotations_of_the_canonical_rig_are_refused() -> None:
    with pytest.raises(InputError, match="no pelvis joint"):
        adapt(skeleton("c13"), random_rotations(13), np.ones(13, np.bool_), axes="global")


@pytest.mark.parametrize("shape", [(12, 4), (13, 3), (13,)])
def test_another_number_of_joints_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="13 joints of 4 numbers"):
        adapt(skeleton("c13"), np.zeros(shape), np.ones(shape[:-1], np.bool_), axes="local")


def test_reference_poses_give_the_identity_in_n_and_raised_arms_in_t() -> None:
    for name, expects_t in (("ebmdb", False), ("cmu", True)):
        source = skeleton(name)
        zero = np.tile(IDENTITY, (len(source.joints), 1))
        local, _ = adapt(source, zero, np.ones(len(source.joints), np.bool_), axes="local")
        expected = np.tile(IDENTITY, (13, 1))
        if expects_t:
            expected[JOINTS.index("l_shoulder")] = T_POSE["l_uparm"]
            expected[JOINTS.index("r_shoulder")] = T_POSE["r_uparm"]
        assert same(local, expected)


def test_formula_of_the_table_for_ebmdb() -> None:
    source = skeleton("ebmdb")
    q = random_rotations(23, seed=9)
    local, _ = adapt(source, q, np.ones(23, np.bool_), axes="local")
    r = {name: Rotation.from_quat(q[index]) for index, name in enumerate(source.joints)}
    table = {
        "spine": r["Chest"] * r["Chest2"],
        "chest": r["Chest3"] * r["Chest4"],
        "head": r["Neck"] * r["Head"],
        "l_shoulder": r["LeftCollar"] * r["LeftShoulder"],
        "l_elbow": r["LeftElbow"],
        "l_wrist": r["LeftWrist"],
        "r_shoulder": r["RightCollar"] * r["RightShoulder"],
        "r_elbow": r["RightElbow"],
        "r_wrist": r["RightWrist"],
        "l_hip": r["LeftHip"],
        "l_knee": r["LeftKnee"],
        "r_hip": r["RightHip"],
        "r_knee": r["RightKnee"],
    }
    assert same(local, np.stack([table[joint].as_quat() for joint in JOINTS]))


def test_formula_of_the_table_for_cmu() -> None:
    source = skeleton("cmu")
    q = random_rotations(31, seed=9)
    local, _ = adapt(source, q, np.ones(31, np.bool_), axes="local")
    r = {name: Rotation.from_quat(q[index]) for index, name in enumerate(source.joints)}
    left = Rotation.from_euler("z", 90, degrees=True)
    table = {
        "spine": r["LowerBack"] * r["Spine"],
        "chest": r["Spine1"],
        "head": r["Neck"] * r["Neck1"] * r["Head"],
        "l_shoulder": r["LeftShoulder"] * r["LeftArm"] * left,
        "l_elbow": left.inv() * r["LeftForeArm"] * left,
        "l_hip": r["LHipJoint"] * r["LeftUpLeg"],
        "l_knee": r["LeftLeg"],
    }
    for joint, turn in table.items():
        assert same(local[JOINTS.index(joint)], turn.as_quat())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", SKELETONS)
def test_a_row_never_depends_on_its_batch(name: str, dtype: npt.DTypeLike) -> None:
    source = skeleton(name)
    count = len(source.joints)
    rotations = random_rotations(40, count, seed=11).astype(dtype)
    rotations[np.random.default_rng(1).random((40, count)) < 0.05] = 0.0
    observed = np.random.default_rng(2).random((40, count)) > 0.05
    single = [adapt(source, rotations[row], observed[row], axes=source.axes) for row in range(40)]
    for size in range(1, 41):
        start = (7 * size) % (41 - size)
        part = slice(start, start + size)
        for block in (rotations[part], np.asfortranarray(rotations[part]), rotations[part][::-1].copy()[::-1]):
            local, seen = adapt(source, block, observed[part], axes=source.axes)
            assert local.dtype == dtype
            for row in range(size):
                assert local[row].tobytes() == single[start + row][0].tobytes()
                assert seen[row].tobytes() == single[start + row][1].tobytes()


def test_a_mirrored_pose_is_the_other_side() -> None:
    local, observed = random_rotations(5, 13), np.random.default_rng(0).random((5, 13)) > 0.5
    swapped, mask = mirror_pose(local, observed)
    flip = np.diag([-1.0, 1.0, 1.0])
    left, right = JOINTS.index("l_elbow"), JOINTS.index("r_elbow")
    for row in range(5):
        expected = flip @ Rotation.from_quat(local[row, left]).as_matrix() @ flip
        assert np.allclose(Rotation.from_quat(swapped[row, right]).as_matrix(), expected)
    assert np.array_equal(mask[:, right], observed[:, left])
    again, mask_again = mirror_pose(swapped, mask)
    assert np.array_equal(again, local)
    assert np.array_equal(mask_again, observed)


@pytest.mark.parametrize("name", SKELETONS)
@pytest.mark.parametrize("seen", [1.0, 0.9])
def test_a_crowd_gets_what_each_gets_alone_to_the_bit(name: str, seen: float) -> None:
    """However they are multiplied, and whether all joints are tracked or some are not."""
    source, crowd, random = skeleton(name), 40, np.random.default_rng(3)
    assert crowd * len(JOINTS) > SMALL > len(JOINTS)
    rotations = random_rotations(crowd, len(source.joints), seed=4) * 1.1
    observed = random.random(rotations.shape[:2]) < seen
    rotations[::3, 1] *= np.where(random.random((len(rotations[::3]), 1)) < seen, 1.0, 0.0)
    rotations[1, 0] = np.inf if seen < 1.0 else rotations[1, 0]
    local, whole = adapt(source, rotations, observed, axes=source.axes)
    for row in range(crowd):
        one = slice(row, row + 1)
        alone, visible = adapt(source, rotations[one], observed[one], axes=source.axes)
        assert alone.tobytes() == local[one].tobytes()
        assert visible.tobytes() == whole[one].tobytes()


def test_joints_given_in_another_order_are_divided_like_all_others() -> None:
    """C13 needs no product, in whatever order its joints come; a bind on top makes it take the long way."""
    rig = skeleton("c13")
    order = [*range(len(JOINTS))][::-1]
    place = {old: new for new, old in enumerate(order)}
    turned = replace(
        rig,
        joints=tuple(rig.joints[joint] for joint in order),
        parents=tuple(ROOT if rig.parents[joint] == ROOT else place[rig.parents[joint]] for joint in order),
        drives=tuple(drive if drive in (None, ROOT) else place[drive] for drive in rig.drives),
    )
    rotations = random_rotations(7, len(JOINTS), seed=5) * 0.9
    observed = np.random.default_rng(6).random(rotations.shape[:2]) < 0.8
    local, seen = adapt(rig, rotations, observed, axes="local")
    again, seen_again = adapt(turned, rotations[:, order], observed[:, order], axes="local")
    assert local.tobytes() == again.tobytes()
    assert seen.tobytes() == seen_again.tobytes()
    expected = rotations / np.linalg.norm(rotations, axis=-1, keepdims=True)
    assert np.allclose(local, np.where(observed[..., None], expected, IDENTITY), rtol=0, atol=1e-15)
    assert np.array_equal(seen, observed)


@needs_data
@pytest.mark.parametrize("file", FILES)
def test_real_recordings_agree_with_formula_3(file: str) -> None:
    recording = read_bvh(DATA / f"{file}.bvh")
    times, local, observed = rig_poses(recording)
    assert observed.all()
    assert np.all(np.diff(times) > 0)
    for frame in range(0, len(recording), 97):
        assert same(local[frame], reference(recording.skeleton, recording.rotations[frame], "local"))
    angles = np.degrees(2 * np.arccos(np.clip(np.abs(local[1:, :9, 3]), 0, 1)))
    assert np.percentile(angles, 99) < 150.0  # nobody's joints are bent further


@needs_data
@pytest.mark.parametrize("file", FILES)
def test_real_zero_poses_are_t_poses_whatever_the_names(file: str) -> None:
    source = read_bvh(DATA / f"{file}.bvh").skeleton
    assert "zero pose T" in source.title
    for segment, bind in zip(SEGMENTS, source.bind, strict=True):
        expected = Rotation.from_quat(T_POSE.get(segment, IDENTITY)).inv().as_quat()
        assert same(bind, expected, 1e-15)


@needs_data
def test_walkers_arms_hang() -> None:
    """With the wrong zero pose every shoulder would be off by a quarter turn."""
    for take in ("angry", "elated", "rushed"):
        _, local, _ = rig_poses(read_bvh(DATA / f"100style/{take}_reference.bvh"))
        for joint in ("l_shoulder", "r_shoulder"):
            angle = 2 * np.arccos(np.clip(np.abs(local[:, JOINTS.index(joint), 3]), 0, 1))
            assert np.degrees(np.median(angle)) < 50.0
