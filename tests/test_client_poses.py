import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fervor.errors import FrameError
from fervor_client.poses import to_joints

JOINTS = ("head", "l_elbow", "r_elbow")
UNIT = (0.0, 0.0, 0.0, 1.0)


@given(hnp.arrays(np.float64, (3, 4), elements=st.floats(-2, 2)))
def test_an_array_keeps_every_bit(pose: np.ndarray) -> None:
    assert np.array(to_joints(pose, JOINTS)["q"]).tobytes() == pose.tobytes()


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda rows: np.array(rows, np.float32)])
def test_arrays_and_nested_sequences_are_the_same(kind: type) -> None:
    assert to_joints(kind([UNIT, UNIT, (0.5, 0.5, 0.5, 0.5)]), JOINTS) == {"q": (UNIT, UNIT, (0.5, 0.5, 0.5, 0.5))}


@pytest.mark.parametrize(
    "gap", [None, [None] * 4, [math.nan] * 4, [0.0, 0.0, math.nan, 1.0], [math.inf, math.nan, 0.0, 0.0]]
)
def test_a_joint_that_is_none_or_holds_a_nan_is_untracked(gap: object) -> None:
    assert to_joints([UNIT, gap, UNIT], JOINTS) == {"q": (UNIT, None, UNIT)}


def test_an_infinite_number_is_refused_with_the_joint() -> None:
    pose = np.tile(UNIT, (3, 1))
    pose[1, 2] = math.inf
    with pytest.raises(FrameError, match=r"joint 1 \(l_elbow\) holds an infinite number"):
        to_joints(pose, JOINTS)


@pytest.mark.parametrize(
    ("pose", "shape"), [(np.zeros((2, 4)), r"\[2, 4\]"), (np.zeros((3, 5)), r"\[3, 5\]"), (np.zeros(12), r"\[12\]")]
)
def test_another_shape_is_refused_with_what_was_expected(pose: np.ndarray, shape: str) -> None:
    with pytest.raises(
        FrameError, match=rf"has the shape {shape}; expected \[3, 4\] \(quaternions\) or \[3, 3\] \(positions\)"
    ):
        to_joints(pose, JOINTS)


@pytest.mark.parametrize("pose", [None, "pose", [UNIT, (0.0, 1.0), UNIT], [UNIT, "x", UNIT], {"head": UNIT}, 3.0])
def test_what_is_no_pose_is_refused(pose: object) -> None:
    with pytest.raises(FrameError, match="pose"):
        to_joints(pose, JOINTS)  # type: ignore[arg-type]


def test_three_numbers_a_joint_are_positions() -> None:
    place = (0.5, 1.5, 2.5)
    assert to_joints([place, None, place], JOINTS) == {"p": (place, None, place)}
    assert to_joints(np.array([place, [math.nan] * 3, place]), JOINTS) == {"p": (place, None, place)}


@pytest.mark.parametrize(("width", "field"), [(4, "q"), (3, "p")])
def test_a_pose_of_nothing_goes_where_the_last_one_went(width: int, field: str) -> None:
    assert to_joints([None] * 3, JOINTS, width=width) == {field: (None,) * 3}
