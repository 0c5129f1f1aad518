"""Local rotations from points: a known motion is put into points by forward kinematics and must come back."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from fervor.errors import InputError
from fervor.skeletons.landmarks import BODY_POINTS, LANDMARKS, POINTS, Landmarks, landmarks
from fervor.skeletons.positions import Straight, local_from_positions, local_over_time, no_hinges
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS

Array = npt.NDArray[np.float64]
REST: dict[str, tuple[str, str, tuple[float, float, float]]] = {
    "spine_mid": ("pelvis", "mid_hip", (0, 0.25, 0)),
    "mid_shoulder": ("thorax", "spine_mid", (0, 0.25, 0)),
    "l_hip": ("pelvis", "mid_hip", (0.1, 0, 0)),
    "r_hip": ("pelvis", "mid_hip", (-0.1, 0, 0)),
    "l_knee": ("l_thigh", "l_hip", (0, -0.4, 0)),
    "r_knee": ("r_thigh", "r_hip", (0, -0.4, 0)),
    "l_ankle": ("l_shank", "l_knee", (0, -0.4, 0)),
    "r_ankle": ("r_shank", "r_knee", (0, -0.4, 0)),
    "l_shoulder": ("thorax", "mid_shoulder", (0.18, 0, 0)),
    "r_shoulder": ("thorax", "mid_shoulder", (-0.18, 0, 0)),
    "l_elbow": ("l_uparm", "l_shoulder", (0, -0.3, 0)),
    "r_elbow": ("r_uparm", "r_shoulder", (0, -0.3, 0)),
    "l_wrist": ("l_forearm", "l_elbow", (0, -0.25, 0)),
    "r_wrist": ("r_forearm", "r_elbow", (0, -0.25, 0)),
    "l_index": ("l_hand", "l_wrist", (0, -0.08, 0.02)),
    "r_index": ("r_hand", "r_wrist", (0, -0.08, 0.02)),
    "l_pinky": ("l_hand", "l_wrist", (0, -0.08, -0.02)),
    "r_pinky": ("r_hand", "r_wrist", (0, -0.08, -0.02)),
    "neck": ("thorax", "mid_shoulder", (0, 0.05, 0)),
    "mid_ear": ("head", "neck", (0, 0.12, 0)),
    "l_ear": ("head", "mid_ear", (0.07, 0, 0)),
    "r_ear": ("head", "mid_ear", (-0.07, 0, 0)),
    "nose": ("head", "mid_ear", (0, 0, 0.1)),
}
"""Where points lie: in the axes of which segment, from which point on."""


def about(axis: str, degrees: npt.ArrayLike) -> Rotation:
    return Rotation.from_rotvec(np.multiply.outer(degrees, np.eye(3)["xyz".index(axis)]), degrees=True)


def moving(frames: int = 60, seed: int = 0, *, bends: bool = False, least: float = 20.0) -> Array:
    """[frame, 13, 4]: any motion that points can show: hinges at elbows and knees, and a trunk that bends evenly."""
    rng = np.random.default_rng(seed)
    local = np.zeros((frames, 13, 4))
    for index, joint in enumerate(JOINTS):
        if joint.endswith(("elbow", "knee")):
            sign = -1 if joint.endswith("elbow") else 1
            turn = about("x", sign * rng.uniform(least, 140, frames))
        elif joint in ("spine", "chest"):
            if joint == "chest":
                local[:, index] = local[:, index - 1]
                continue
            bend = rng.normal(0, 20, (frames, 3)) if bends else rng.normal(0, 20, (frames, 1)) * [0, 1, 0]
            turn = Rotation.from_rotvec(bend, degrees=True)
        else:
            turn = Rotation.from_rotvec(rng.normal(0, 50, (frames, 3)), degrees=True)
        local[:, index] = turn.as_quat()
    return local


def points_of(local: Array, camera: Rotation, *, size: float = 1.0) -> dict[str, Array]:
    """Positions [frame, 3] of all points by forward kinematics, seen from a camera 3 m away."""
    whole = {0: Rotation.identity(len(local))}
    for joint in range(13):
        whole[CHILD_SEGMENT[joint]] = whole[PARENT_SEGMENT[joint]] * Rotation.from_quat(local[:, joint])
    at = {"mid_hip": np.zeros((len(local), 3))}
    for point, (segment, start, offset) in REST.items():
        at[point] = at[start] + whole[SEGMENTS.index(segment)].apply(np.array(offset) * size)
    return {point: camera.apply(place) + np.array([0.1, -0.2, 3.0]) for point, place in at.items()}


def sent(sensor: Landmarks, at: dict[str, Array]) -> Array:
    """[frame, joint, 3] as the sensor orders them; points it has besides lie anywhere."""
    frames = len(at["nose"])
    positions = np.random.default_rng(0).normal(size=(frames, len(sensor.joints), 3))
    for point, index in sensor.points.items():
        positions[:, index] = at[point]
    return positions


def apart(a: Array, b: Array) -> float:
    """Largest angle between rotations, radians."""
    return float((Rotation.from_quat(a.reshape(-1, 4)).inv() * Rotation.from_quat(b.reshape(-1, 4))).magnitude().max())


def all_seen(positions: Array) -> npt.NDArray[np.bool_]:
    return np.ones(positions.shape[:-1], np.bool_)


@pytest.mark.parametrize("name", LANDMARKS)
def test_a_motion_comes_back_from_any_side_and_size(name: str) -> None:
    sensor = landmarks(name)
    truth = moving(bends=name == "points")
    hands = "l_index" in sensor.points
    for place in range(10):
        camera = Rotation.random(random_state=place)
        positions = sent(sensor, points_of(truth, camera, size=(0.6, 1.0, 1.2, 1000.0)[place % 4]))
        local, observed = local_over_time(sensor, positions, all_seen(positions))
        for index, joint in enumerate(JOINTS):
            assert observed[:, index].all() == (hands or not joint.endswith("wrist"))
            if observed[:, index].all():
                assert apart(local[:, index], truth[:, index]) < 1e-7, joint


def test_an_n_pose_is_the_identity() -> None:
    rest = np.tile([0.0, 0, 0, 1], (1, 13, 1))
    positions = sent(BODY_POINTS, points_of(rest, Rotation.random(random_state=1)))
    local, observed = local_over_time(BODY_POINTS, positions, all_seen(positions))
    never_bent = {"l_shoulder", "r_shoulder", "l_wrist", "r_wrist", "l_hip", "r_hip"}
    assert {joint for joint, seen in zip(JOINTS, observed[0], strict=True) if not seen} == never_bent
    assert np.allclose(np.abs(local[..., 3]), 1.0)


def straightening(frames: int = 40) -> Array:
    """Elbows bend first, then stay straight while the arms rise sideways; legs stand still, knees bent."""
    local = np.tile([0.0, 0, 0, 1], (frames, 13, 1))
    bend = np.linspace(60, 0, frames // 2)
    rise = np.concatenate([np.zeros(frames // 2), np.linspace(0, 80, frames - frames // 2)])
    for joint, turn in {
        "l_elbow": about("x", -np.pad(bend, (0, frames - len(bend)))),
        "r_elbow": about("x", -np.pad(bend, (0, frames - len(bend)))),
        "l_shoulder": about("z", rise),
        "r_shoulder": about("z", -rise),
        "l_knee": about("x", np.full(frames, 30)),
        "r_knee": about("x", np.full(frames, 30)),
    }.items():
        local[:, JOINTS.index(joint)] = turn.as_quat()
    return local


def test_straight_arms_carry_their_hinge_on() -> None:
    truth = straightening()
    positions = sent(BODY_POINTS, points_of(truth, Rotation.random(random_state=1)))
    local, observed = local_over_time(BODY_POINTS, positions, all_seen(positions))
    assert observed.all()
    assert apart(local, truth) < 1e-6


def test_a_turning_body_takes_its_straight_arms_along() -> None:
    """The hinge is kept relative to the trunk: standing arms don't twist when the person turns round."""
    truth = straightening()
    turning = [points_of(truth[[frame]], about("y", 9 * frame)) for frame in range(40)]
    at = {point: np.concatenate([places[point] for places in turning]) for point in turning[0]}
    positions = sent(BODY_POINTS, at)
    local, _ = local_over_time(BODY_POINTS, positions, all_seen(positions))
    assert apart(local, truth) < 1e-6


def test_straight_limbs_can_be_masked() -> None:
    truth = straightening()
    positions = sent(BODY_POINTS, points_of(truth, Rotation.identity()))
    _, observed = local_over_time(BODY_POINTS, positions, all_seen(positions), straight="mask")
    angle = (Rotation.from_quat(truth[:, JOINTS.index("l_elbow")])).magnitude()
    shoulder = observed[:, JOINTS.index("l_shoulder")]
    assert np.array_equal(shoulder, np.sin(angle) >= 0.25)
    assert observed[:, JOINTS.index("l_elbow")].all()
    assert observed[:, JOINTS.index("l_hip")].all()


@pytest.mark.parametrize("straight", ["carry", "mask"])
def test_frame_by_frame_is_the_whole_recording_and_batches_never_matter(straight: Straight) -> None:
    sensor = landmarks("mediapipe")
    takes = []
    for seed in range(7):
        truth = moving(30, seed, least=0.0)
        takes.append(sent(sensor, points_of(truth, Rotation.random(random_state=seed))))
    positions = np.stack(takes)  # [take, frame, joint, 3]
    observed = np.random.default_rng(0).random(positions.shape[:-1]) > 0.02
    whole = [
        local_over_time(sensor, take, seen, straight=straight)
        for take, seen in zip(positions, observed, strict=True)
    ]  # fmt: skip
    hinges = no_hinges((7,))
    for frame in range(30):
        local, seen, hinges = local_from_positions(
            sensor, positions[:, frame], observed[:, frame], hinges, straight=straight
        )
        for take in range(7):
            assert local[take].tobytes() == whole[take][0][frame].tobytes()
            assert seen[take].tobytes() == whole[take][1][frame].tobytes()


def test_float32_stays_float32() -> None:
    sensor = landmarks("mediapipe")
    truth = moving(10)
    positions = sent(sensor, points_of(truth, Rotation.identity())).astype(np.float32)
    local, observed, hinges = local_from_positions(sensor, positions, all_seen(positions), no_hinges((10,), np.float32))
    assert local.dtype == hinges.dtype == np.float32
    assert observed.all()
    assert apart(local.astype(np.float64), truth) < 1e-2


@pytest.mark.parametrize("lost", POINTS)
@pytest.mark.parametrize("how", ["mask", "nan", "inf", "huge"])
def test_a_lost_point_hides_what_needs_it_and_nothing_else(lost: str, how: str) -> None:
    truth = moving(20, bends=False)
    positions = sent(BODY_POINTS, points_of(truth, Rotation.identity()))
    observed = all_seen(positions)
    index = BODY_POINTS.points[lost]
    if how == "mask":
        observed[:, index] = False
    else:
        positions[:, index, 1] = {"nan": np.nan, "inf": np.inf, "huge": 1e300}[how]
    local, seen = local_over_time(BODY_POINTS, positions, observed)
    side, part = lost[0], lost[2:]
    hides = {
        "hip": {"spine", "chest", "l_hip", "r_hip", f"{side}_knee"},
        "knee": {f"{side}_hip", f"{side}_knee"},
        "ankle": {f"{side}_hip", f"{side}_knee"},
        "shoulder": {"spine", "chest", "head", "l_shoulder", "r_shoulder", f"{side}_elbow", "l_wrist", "r_wrist"},
        "elbow": {f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"},
        "wrist": {f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"},
        "index": {f"{side}_wrist"},
        "pinky": {f"{side}_wrist"},
        "ear": {"head"},
    }
    expected = {"nose": {"head"}, "spine_mid": set()}.get(lost, hides.get(part, set()))
    for joint_index, joint in enumerate(JOINTS):
        assert seen[:, joint_index].any() == (joint not in expected), joint
        if joint in expected:
            assert np.array_equal(local[:, joint_index], np.tile([0.0, 0, 0, 1], (20, 1)))
        else:
            assert apart(local[:, joint_index], truth[:, joint_index]) < 1e-7
    assert np.isfinite(local).all()


def test_points_that_coincide_are_no_direction() -> None:
    positions = np.zeros((3, len(POINTS), 3))
    local, observed = local_over_time(BODY_POINTS, positions, all_seen(positions))
    assert not observed.any()
    assert np.isfinite(local).all()


def test_another_number_of_points_is_refused() -> None:
    with pytest.raises(InputError, match="'coco17' has 17 points of 3 numbers"):
        local_over_time(landmarks("coco17"), np.zeros((2, 16, 3)), np.ones((2, 16), np.bool_))


def test_an_unknown_sensor_is_refused() -> None:
    with pytest.raises(InputError, match="'halpe' is not known; expected one of mediapipe, coco17, body25, points"):
        landmarks("halpe")


def test_landmark_numbers_are_those_of_the_sensors() -> None:
    pose = landmarks("MediaPipe")
    assert len(pose.joints) == 33
    wanted = {"nose": 0, "l_ear": 7, "r_shoulder": 12, "l_wrist": 15, "r_pinky": 18, "l_index": 19, "r_ankle": 28}
    assert {point: pose.points[point] for point in wanted} == wanted
    body = landmarks("body25")
    assert (body.points["r_wrist"], body.points["l_hip"], body.points["l_ear"]) == (4, 12, 18)
    assert landmarks("coco17").points["r_ankle"] == 16
