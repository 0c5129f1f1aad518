"""The gate through which poses enter."""

import numpy as np
import pytest

from fervor.errors import FrameError
from fervor.protocol.messages import Frame, Raw
from fervor.protocol.poses import frame_points, frame_pose

JOINTS = ("a", "b", "c")
UNIT = (0.0, 0.0, 0.0, 1.0)


def frame(*q, mask=None):
    return Frame(body="eve", seq=7, t=0.0, q=q, mask=mask)


def test_order_on_the_wire():
    rotations, observed = frame_pose(frame((1.0, 0.0, 0.0, 0.0), UNIT, UNIT), JOINTS, "wxyz")
    assert rotations[0].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert rotations.dtype == np.float64
    assert observed.all()


def test_null_zero_short_and_masked_are_untracked_not_wrong():
    _, observed = frame_pose(frame(None, (0.0, 0.0, 0.0, 0.0), (0.0, 0.3, 0.0, 0.2)), JOINTS, "xyzw")
    assert not observed.any()
    _, observed = frame_pose(frame(UNIT, UNIT, UNIT, mask=(True, False, True)), JOINTS, "xyzw")
    assert observed.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        (frame(UNIT), "has 1 joints in q; expected 3"),
        (frame(UNIT, UNIT, UNIT, mask=(True,)), "has 1 entries in mask; expected 3"),
        (frame(UNIT, (0.0, float("nan"), 0.0, 1.0), UNIT), r"at joint 1 \(b\); expected four finite numbers"),
        (frame(UNIT, UNIT, (float("inf"), 0.0, 0.0, 1.0)), r"at joint 2 \(c\); expected four finite numbers"),
        (frame(UNIT, UNIT, (1e300, 0.0, 0.0, 1.0)), r"far from unit length at joint 2 \(c\)"),
    ],
)
def test_poison_is_refused_whole_naming_the_joint(bad, told):
    with pytest.raises(FrameError, match=told) as caught:
        frame_pose(bad, JOINTS, "xyzw")
    assert caught.value.message.startswith("frame 7 of body 'eve' ")
    assert (caught.value.body, caught.value.seq) == ("eve", 7)


def points(*p, mask=None, **more):
    return Frame(body="eve", seq=7, t=0.0, p=p, mask=mask, **more)


def test_positions_of_landmark_sensors():
    positions, observed = frame_points(points((1, 2, 3.5), None, (0, 0, 0), mask=(True, True, False)), JOINTS)
    assert positions.tolist() == [[1, 2, 3.5], [0, 0, 0], [0, 0, 0]]
    assert observed.tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        (points((0, 0, 0)), "has 1 joints in p; expected 3"),
        (points(None, (0, float("nan"), 0), None), r"at joint 1 \(b\); expected three finite numbers"),
        (points(None, None, (0, 1e12, 0)), r"at joint 2 \(c\); expected three finite numbers"),
        (frame(UNIT, UNIT, UNIT), "expected positions in p alone"),
        (Frame(body="eve", seq=7, t=0.0), "has no p; expected 3 joints"),
        (points(None, None, None, q=(UNIT, UNIT, UNIT)), "expected positions in p alone"),
    ],
)
def test_poisoned_positions(bad, told):
    with pytest.raises(FrameError, match=told):
        frame_points(bad, JOINTS)


def test_positions_for_a_skeleton_of_rotations_are_told():
    with pytest.raises(FrameError, match="has no q; expected 3 joints"):
        frame_pose(Frame(seq=7, t=0.0), JOINTS, "xyzw")
    with pytest.raises(FrameError, match="expected quaternions in q alone"):
        frame_pose(points(None, None, None, q=(UNIT, UNIT, UNIT)), JOINTS, "xyzw")


def test_raw_joints_are_float32():
    rotations = np.array([UNIT, (0.0, 0.0, 0.0, 0.0), UNIT], "<f4")
    got, observed = frame_pose(Frame(seq=7, t=0.0, q=Raw(rotations.tobytes())), JOINTS, "xyzw")
    assert np.array_equal(got, rotations)
    assert observed.tolist() == [True, False, True]
    spots = np.array([(1, 2, 3), (np.nan, 0, 0), (0, 0, 0)], "<f4")
    got, observed = frame_points(Frame(seq=7, t=0.0, p=Raw(spots.tobytes())), JOINTS)
    assert got.tolist() == [[1, 2, 3], [0, 0, 0], [0, 0, 0]]
    assert observed.tolist() == [True, False, True]


def test_poisoned_raw_joints():
    with pytest.raises(FrameError, match="has 12 bytes in q; expected 48: 3 joints of 4 float32"):
        frame_pose(Frame(body="eve", seq=7, t=0.0, q=Raw(b"x" * 12)), JOINTS, "xyzw")
    nan = np.full((3, 4), np.nan, "<f4").tobytes()
    with pytest.raises(FrameError, match=r"at joint 0 \(a\); expected four finite numbers"):
        frame_pose(Frame(body="eve", seq=7, t=0.0, q=Raw(nan)), JOINTS, "xyzw")
