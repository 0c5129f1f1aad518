"""Many frames at once are what the gate gives one by one, or left to it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bodies import motion
from fervor.errors import FrameError
from fervor.protocol.messages import Frame, Raw
from fervor.protocol.pose_blocks import PoseBlock, position_block, rotation_block
from fervor.protocol.poses import frame_points, frame_pose

JOINTS = ("a", "b", "c")
STRANGE = [0.0, -0.0, 0.25, 0.5, 1.0, -1.0, 2.0, 1e9, 1e10, 1e200, 1e300, float("inf"), float("nan")]
NUMBER = st.sampled_from([0.0, 0.5, 1.0, 2.0]) | st.floats(-1.5, 1.5)
MASK = st.none() | st.lists(st.booleans(), min_size=3, max_size=3).map(tuple)
USUAL = st.just([])
SPOILT = st.sampled_from(["null", "fewer", "more", "short mask", "nothing", *STRANGE])


@st.composite
def frames(draw: st.DrawFn, width: int) -> tuple[object, object]:
    """What a frame has in `q` or `p`, as arrays or raw, and in `mask`; now and then something is wrong with it."""
    joints: list = [list(draw(st.tuples(*[NUMBER] * width))) for _ in JOINTS]
    raw, mask = draw(st.booleans()), draw(MASK)
    for spoilt in draw(USUAL | st.lists(SPOILT, max_size=2)):
        joint = draw(st.integers(0, len(joints) - 1))
        match spoilt:
            case "null":
                joints[joint] = [float("nan")] * width if raw else None
            case "fewer":
                joints = joints[:-1] or joints
            case "more":
                joints.append([1.0] * width)
            case "short mask":
                mask = (True,)
            case "nothing":
                return None, mask
            case float(number) if joints[joint] is not None:
                joints[joint][draw(st.integers(0, width - 1))] = number
    if raw:
        with np.errstate(over="ignore"):
            return np.array(joints, "<f4").tobytes(), mask
    return tuple(None if joint is None else tuple(joint) for joint in joints), mask


def agree(block: PoseBlock, given: list, one_by_one) -> None:
    """Each frame is what the gate gives; doubtful are those that it refuses."""
    for row, (sent, mask) in enumerate(given):
        try:
            joints, observed = one_by_one(Raw(sent) if isinstance(sent, bytes) else sent, mask)
        except FrameError:
            assert row in block.doubtful
        else:
            assert row not in block.doubtful
            assert block.joints[row].tobytes() == joints.tobytes()
            assert block.observed[row].tolist() == observed.tolist()
    assert block.joints.dtype == np.float64
    assert block.doubtful <= set(range(len(given)))


@given(st.lists(frames(4), min_size=1, max_size=6), st.sampled_from(["xyzw", "wxyz"]))
def test_rotations_at_once_are_those_one_by_one(given, order) -> None:
    block = rotation_block(*zip(*given, strict=True), 3, order)
    agree(block, given, lambda q, mask: frame_pose(Frame(seq=0, q=q, mask=mask), JOINTS, order))


@given(st.lists(frames(3), min_size=1, max_size=6))
def test_positions_at_once_are_those_one_by_one(given) -> None:
    block = position_block(*zip(*given, strict=True), 3)
    agree(block, given, lambda p, mask: frame_points(Frame(seq=0, p=p, mask=mask), JOINTS))


GOOD = motion(2, joints=3)
RAW = [np.float32(pose).tobytes() for pose in GOOD]
SIGNALLING = b"\x00\x00\xa0\x7f" * 12  # a NaN of which the processor wants to tell


@pytest.mark.parametrize(
    "sent",
    [
        RAW[1][:-4],
        RAW[1] * 2,
        np.full(12, np.inf, "<f4").tobytes(),
        SIGNALLING,
        None,
        GOOD[1][:2].tolist(),
        [[float("nan"), 0, 0, 1]] * 3,
        [[10**400, 0, 0, 1]] * 3,
        [[1e300, 0, 0, 1]] * 3,
    ],
)
@pytest.mark.parametrize("good", [RAW[0], GOOD[0].tolist()])
def test_a_wrong_frame_is_doubtful_and_its_neighbours_are_not(sent, good) -> None:
    block = rotation_block([good, sent, good], [None] * 3, 3, "xyzw")
    assert block.doubtful == {1}
    assert block.observed[[0, 2]].all()
    assert (block.joints[0] == block.joints[2]).all()


def test_neither_is_one_with_a_mask_of_another_length() -> None:
    block = rotation_block(RAW, [(True, True, False), (True,) * 2], 3, "xyzw")
    assert block.doubtful == {1}
    assert block.observed[0].tolist() == [True, True, False]


def test_a_signalling_number_is_an_untracked_position() -> None:
    block = position_block([SIGNALLING[:36]], [None], 3)
    assert block.joints.tolist() == [[[0.0] * 3] * 3]
    assert not block.observed.any()
    assert not block.doubtful
