"""Joint angles of REP-155's human, against a forward kinematics of our own on scipy: where hands and feet end up."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fervor.skeletons.adapter import adapt
from fervor.skeletons.rig import JOINTS
from fervor.skeletons.ros4hri import ROS4HRI
from fervor_ros.human_description import AXES, CHAINS, link_rotations

# joint of the URDF: parent joint, where it stands in the parent's link (metres: x forward, y left, z up), its axis
URDF = {
    "waist": (None, (0, 0, 0), (0, 1, 0)),
    "r_head": ("waist", (0, 0, 0.66), (1, 0, 0)),
    "y_head": ("r_head", (0, 0, 0), (0, 0, 1)),
    "p_head": ("y_head", (0, 0, 0), (0, -1, 0)),
    "l_y_shoulder": ("waist", (0, 0.18, 0.6), (0, 0, -1)),
    "l_p_shoulder": ("l_y_shoulder", (0, 0, 0), (1, 0, 0)),
    "l_r_shoulder": ("l_p_shoulder", (0, 0, 0), (0, 0, 1)),
    "l_elbow": ("l_r_shoulder", (0, 0, -0.35), (0, -1, 0)),
    "r_y_shoulder": ("waist", (0, -0.18, 0.6), (0, 0, 1)),
    "r_p_shoulder": ("r_y_shoulder", (0, 0, 0), (-1, 0, 0)),
    "r_r_shoulder": ("r_p_shoulder", (0, 0, 0), (0, 0, -1)),
    "r_elbow": ("r_r_shoulder", (0, 0, -0.35), (0, -1, 0)),
    "l_y_hip": (None, (0, 0.13, 0), (0, 0, -1)),
    "l_p_hip": ("l_y_hip", (0, 0, 0), (1, 0, 0)),
    "l_r_hip": ("l_p_hip", (0, 0, 0), (0, -1, 0)),
    "l_knee": ("l_r_hip", (0, 0, -0.33), (0, -1, 0)),
    "r_y_hip": (None, (0, -0.13, 0), (0, 0, -1)),
    "r_p_hip": ("r_y_hip", (0, 0, 0), (-1, 0, 0)),
    "r_r_hip": ("r_p_hip", (0, 0, 0), (0, -1, 0)),
    "r_knee": ("r_r_hip", (0, 0, -0.33), (0, -1, 0)),
}
# points on the body: the joint whose link they are fixed to, and where
POINTS = {
    "neck": ("waist", (0, 0, 0.66)),
    "nose": ("p_head", (0.1, 0, 0.1)),
    "l_elbow": ("l_r_shoulder", (0, 0, -0.35)),
    "l_wrist": ("l_elbow", (0, 0, -0.22)),
    "l_thumb": ("l_elbow", (0.05, 0, -0.25)),
    "r_elbow": ("r_r_shoulder", (0, 0, -0.35)),
    "r_wrist": ("r_elbow", (0, 0, -0.22)),
    "r_thumb": ("r_elbow", (0.05, 0, -0.25)),
    "l_knee": ("l_r_hip", (0, 0, -0.33)),
    "l_toe": ("l_knee", (0.1, 0, -0.44)),
    "r_knee": ("r_r_hip", (0, 0, -0.33)),
    "r_toe": ("r_knee", (0.1, 0, -0.44)),
}
# the same points by the rig: the rotating joints above them, root first, each with where it stands in its segment
TRUNK = [("spine", (0, 0, 0)), ("chest", (0, 0, 0))]
RIG = {
    "neck": (TRUNK, (0, 0, 0.66)),
    "nose": ([*TRUNK, ("head", (0, 0, 0.66))], (0.1, 0, 0.1)),
    **{
        f"{side}_{point}": ([*TRUNK, (f"{side}_shoulder", (0, out, 0.6)), *elbow], at)
        for side, out in (("l", 0.18), ("r", -0.18))
        for point, elbow, at in (
            ("elbow", [], (0, 0, -0.35)),
            ("wrist", [(f"{side}_elbow", (0, 0, -0.35))], (0, 0, -0.22)),
            ("thumb", [(f"{side}_elbow", (0, 0, -0.35))], (0.05, 0, -0.25)),
        )
    },
    **{
        f"{side}_{point}": ([(f"{side}_hip", (0, out, 0)), *knee], at)
        for side, out in (("l", 0.13), ("r", -0.13))
        for point, knee, at in (
            ("knee", [], (0, 0, -0.33)),
            ("toe", [(f"{side}_knee", (0, 0, -0.33))], (0.1, 0, -0.44)),
        )
    },
}


def placed(joint: str | None, angles: dict[str, float]) -> tuple[Rotation, np.ndarray]:
    """Where a joint's link is, and how it is turned."""
    if joint is None:
        return Rotation.identity(), np.zeros(3)
    parent, offset, axis = URDF[joint]
    turn, place = placed(parent, angles)
    return turn * Rotation.from_rotvec(np.array(axis) * angles[joint]), place + turn.apply(offset)


def by_urdf(point: str, angles: dict[str, float]) -> np.ndarray:
    joint, offset = POINTS[point]
    turn, place = placed(joint, angles)
    return place + turn.apply(offset)


def by_rig(point: str, local: np.ndarray) -> np.ndarray:
    """By the rig's local rotations [13, 4], in its axes (left, up, forward), told in ROS's."""
    turn, place = Rotation.identity(), np.zeros(3)
    chain, offset = RIG[point]
    for joint, stands in chain:
        place = place + turn.apply(to_rig(stands))
        turn = turn * Rotation.from_quat(local[JOINTS.index(joint)])
    left, up, forward = place + turn.apply(to_rig(offset))
    return np.array([forward, left, up])


def to_rig(vector: tuple[float, float, float]) -> np.ndarray:
    forward, left, up = vector
    return np.array([left, up, forward])


def rig_of(angles: dict[str, float]) -> np.ndarray:
    rotations = link_rotations(list(angles), list(angles.values()))
    local, _ = adapt(ROS4HRI, rotations, np.ones(len(rotations), bool), axes="local")
    return local


def test_the_table_is_the_urdf() -> None:
    assert {joint: axis for joint, (_, _, axis) in URDF.items()} == AXES
    assert sorted(joint for chain in CHAINS.values() for joint in chain) == sorted(URDF)


@given(st.lists(st.floats(-3.1, 3.1), min_size=len(URDF), max_size=len(URDF)))
def test_every_point_of_the_body_is_where_the_urdf_has_it(values: list[float]) -> None:
    angles = dict(zip(URDF, values, strict=True))
    local = rig_of(angles)
    for point in POINTS:
        assert by_rig(point, local) == pytest.approx(by_urdf(point, angles), abs=1e-9)


@pytest.mark.parametrize(
    ("joint", "angle", "point", "goes"),
    [
        ("waist", 0.5, "neck", (1, 0, -1)),
        ("p_head", 0.5, "nose", (-1, 0, 1)),
        ("y_head", 0.5, "nose", (-1, 1, 0)),
        ("l_p_shoulder", 0.5, "l_wrist", (0, 1, 1)),
        ("r_p_shoulder", 0.5, "r_wrist", (0, -1, 1)),
        ("l_elbow", 0.5, "l_wrist", (1, 0, 1)),
        ("r_elbow", 0.5, "r_wrist", (1, 0, 1)),
        ("l_r_hip", 0.5, "l_knee", (1, 0, 1)),
        ("r_p_hip", 0.5, "r_knee", (0, -1, 1)),
        ("l_knee", -0.5, "l_toe", (-1, 0, 1)),
    ],
)
def test_limbs_go_where_people_would_say(joint: str, angle: float, point: str, goes: tuple[int, int, int]) -> None:
    still = dict.fromkeys(URDF, 0.0)
    way = by_rig(point, rig_of({**still, joint: angle})) - by_rig(point, rig_of(still))
    assert tuple(np.sign(np.round(way, 9)).astype(int)) == goes


def test_names_with_the_id_and_without_mean_the_same() -> None:
    names, angles = list(AXES), np.linspace(-1.0, 1.0, len(AXES)).tolist()
    plain = link_rotations(names, angles)
    assert np.array_equal(link_rotations([f"{name}_b_7" for name in names], angles, body="b_7"), plain)
    assert np.isnan(link_rotations([f"{name}_b_7" for name in names], angles, body="b_8")[1:]).all()


def test_what_has_no_angle_is_untracked() -> None:
    angles = {joint: 0.1 for joint in AXES if joint not in ("l_p_shoulder", "r_knee")}
    rotations = link_rotations([*angles, "tail", "r_knee"], [*angles.values(), 0.3, float("inf")])
    untracked = np.isnan(rotations).any(axis=-1)
    assert {ROS4HRI.joints[index] for index in np.flatnonzero(untracked)} == {"l_shoulder", "r_knee"}
    assert np.isnan(link_rotations(["waist", "p_head"], [0.1])[ROS4HRI.joints.index("head")]).all()
