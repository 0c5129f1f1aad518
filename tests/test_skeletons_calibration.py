"""A held pose gives the alignment of a sensor whose conventions nobody knows, exactly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import InputError
from fervor.skeletons.adapter import adapt
from fervor.skeletons.calibration import calibrate, facing
from fervor.skeletons.catalog import skeleton
from fervor.skeletons.rig import CHILD_SEGMENT, PARENT_SEGMENT, SEGMENTS
from fervor.skeletons.skeleton import Skeleton

ARMS = {"l_uparm": 90, "l_forearm": 90, "l_hand": 90, "r_uparm": -90, "r_forearm": -90, "r_hand": -90}


def sensor(seed: int) -> tuple[Skeleton, list[Rotation], Rotation]:
    """A sensor of one joint a segment with random joint axes, and the person's left, up, forward in its axes."""
    random = np.random.default_rng(seed)
    known = Skeleton(
        name="odd",
        title="odd",
        joints=SEGMENTS,
        parents=(-1,) * 14,
        axes="global",
        drives=tuple(range(14)),
        bind=np.tile([0.0, 0.0, 0.0, 1.0], (14, 1)),
    )
    return known, [Rotation.random(random_state=random) for _ in SEGMENTS], Rotation.random(random_state=random)


def rendered(local: np.ndarray, joint_axes: list[Rotation], person: Rotation) -> np.ndarray:
    """What the sensor gives for rig rotations [13, 4]: Q_j = U S_j B_j, [14, 4]."""
    whole = {0: Rotation.identity()}
    for joint, (above, below) in enumerate(zip(PARENT_SEGMENT, CHILD_SEGMENT, strict=True)):
        whole[below] = whole[above] * Rotation.from_quat(local[joint])
    return np.stack([(person * whole[segment] * joint_axes[segment]).as_quat() for segment in range(14)])


def held(pose: str) -> np.ndarray:
    """Rig rotations [13, 4] of the pose."""
    whole = [Rotation.from_euler("Z", ARMS.get(name, 0) if pose == "t" else 0, degrees=True) for name in SEGMENTS]
    return np.stack([(whole[a].inv() * whole[b]).as_quat() for a, b in zip(PARENT_SEGMENT, CHILD_SEGMENT, strict=True)])


@pytest.mark.parametrize("pose", ["n", "t"])
@pytest.mark.parametrize("seed", range(5))
def test_any_sensor_becomes_the_rig(pose, seed):
    known, joint_axes, person = sensor(seed)
    frames = np.tile(rendered(held(pose), joint_axes, person), (30, 1, 1))
    up, forward = person.apply([0, 1, 0]), person.apply([0, 0, 1])
    found = calibrate(
        known, frames, np.ones((30, 14), np.bool_), axes="global", pose=pose, person=facing(up * 3, forward * 0.1)
    )
    truth = Rotation.random(13, random_state=seed).as_quat()
    camera = Rotation.random(random_state=seed + 50)  # the sensor may even be moved afterwards
    seen = (camera * Rotation.from_quat(rendered(truth, joint_axes, person))).as_quat()
    local, observed = adapt(found.skeleton, seen, np.ones(14, np.bool_), axes="global")
    assert observed.all()
    assert (Rotation.from_quat(local).inv() * Rotation.from_quat(truth)).magnitude().max() < 1e-7
    assert found.spread_deg < 1e-4
    assert found.unseen == ()


def test_trembling_is_averaged_and_told():
    known, joint_axes, person = sensor(1)
    random = np.random.default_rng(2)
    still = Rotation.from_quat(np.tile(rendered(held("n"), joint_axes, person), (60, 1, 1)).reshape(-1, 4))
    shaken = still * Rotation.from_rotvec(random.normal(0, 0.03, (60 * 14, 3)))
    up, forward = person.apply([0, 1, 0]), person.apply([0, 0, 1])
    found = calibrate(
        known,
        shaken.as_quat().reshape(60, 14, 4),
        np.ones((60, 14), np.bool_),
        axes="global",
        pose="n",
        person=facing(up, forward),
    )
    local, _ = adapt(found.skeleton, rendered(held("n"), joint_axes, person), np.ones(14, np.bool_), axes="global")
    assert Rotation.from_quat(local).magnitude().max() < 0.03
    assert 1.0 < found.spread_deg < 15.0


def test_local_rotations_are_composed_first():
    known = skeleton("ebmdb")
    random = np.random.default_rng(3)
    frames = np.tile(Rotation.random(23, random_state=random).as_quat(), (10, 1, 1))
    found = calibrate(
        known, frames, np.ones((10, 23), np.bool_), axes="local", pose="n", person=facing((0, 1, 0), (0, 0, 1))
    )
    local, _ = adapt(found.skeleton, frames[0], np.ones(23, np.bool_), axes="local")
    assert Rotation.from_quat(local).magnitude().max() < 1e-7


def test_what_was_never_tracked_keeps_its_alignment():
    known, joint_axes, person = sensor(1)
    observed = np.ones((5, 14), np.bool_)
    observed[:, 6] = False
    found = calibrate(
        known,
        np.tile(rendered(held("n"), joint_axes, person), (5, 1, 1)),
        observed,
        axes="global",
        pose="n",
        person=facing((0, 1, 0), (0, 0, 1)),
    )
    assert found.unseen == (SEGMENTS[6],)
    assert np.array_equal(found.skeleton.bind[6], known.bind[6])


def test_motion_is_no_pose():
    known, _, _ = sensor(1)
    moving = Rotation.random(20 * 14, random_state=1).as_quat().reshape(20, 14, 4)
    with pytest.raises(InputError, match="not held still: pelvis strayed by"):
        calibrate(
            known, moving, np.ones((20, 14), np.bool_), axes="global", pose="n", person=facing((0, 1, 0), (0, 0, 1))
        )


def test_the_rig_itself_needs_no_calibration():
    with pytest.raises(InputError, match="'c13' has no pelvis joint"):
        calibrate(
            skeleton("c13"),
            np.zeros((3, 13, 4)),
            np.ones((3, 13), np.bool_),
            axes="local",
            pose="n",
            person=facing((0, 1, 0), (0, 0, 1)),
        )
    known, _, _ = sensor(1)
    with pytest.raises(InputError, match="no frame"):
        calibrate(
            known,
            np.zeros((0, 14, 4)),
            np.ones((0, 14), np.bool_),
            axes="global",
            pose="n",
            person=facing((0, 1, 0), (0, 0, 1)),
        )


@pytest.mark.parametrize(
    ("up", "forward"), [((0, 0, 0), (0, 0, 1)), ((0, 1, 0), (0, -2, 0)), ((0, 1, 0), (0, 0, np.nan))]
)
def test_directions_must_span_a_plane(up, forward):
    with pytest.raises(InputError, match="expected two different directions"):
        facing(up, forward)
