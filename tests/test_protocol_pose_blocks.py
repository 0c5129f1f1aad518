"""Many frames at once are what the gate gives one by one, or left to it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bodies import motion
from fervor.errors import FrameError
from fervor.protocol.messages import Frame, Raw
from fervor.protocol.pose_blocks import pose_block
from fervor.protocol.poses import frame_pose

JOINTS = ("a", "b", "c")
NUMBER = st.sampled_from([0.0, 0.25, 0.5, 1.0, 1.2, -1.0]) | st.floats(-1.5, 1.5, width=32)
POSE = st.lists(st.tuples(NUMBER, NUMBER, NUMBER, NUMBER), min_size=3, max_size=3).map(tuple)
MASK = st.none() | st.tuples(st.booleans(), st.booleans(), st.booleans())


@pytest.mark.parametrize("raw", [False, True])
@given(st.lists(st.tuples(POSE, MASK), min_size=1, max_size=6), st.sampled_from(["xyzw", "wxyz"]))
def test_at_once_is_one_by_one(raw, frames, order):
    sent = [np.array(q, "<f4").tobytes() if raw else q for q, _ in frames]
    masks = [mask for _, mask in frames]
    try:
        expected = [
            frame_pose(Frame(seq=0, q=Raw(q) if raw else q, mask=mask), JOINTS, order)
            for q, mask in zip(sent, masks, strict=True)
        ]
    except FrameError:
        assert pose_block(sent, masks, 3, order) is None
        return
    block = pose_block(sent, masks, 3, order)
    if block is None:
        assert len({mask is None for mask in masks}) == 2  # unlike each other, nothing else
        return
    for rotations, observed, (one, seen) in zip(*block, expected, strict=True):
        assert rotations.tobytes() == one.tobytes()
        assert (observed == seen).all()


GOOD = [np.float32(pose).tobytes() for pose in motion(2, joints=3)]


@pytest.mark.parametrize(
    "sent",
    [
        [GOOD[0], GOOD[1][:-4]],
        [GOOD[0], None],
        [GOOD[0], motion(1, joints=3)[0].tolist()],
        [motion(1, joints=3)[0].tolist(), [None] * 3],
        [motion(1, joints=2)[0].tolist()] * 2,
        [[[float("nan"), 0, 0, 1]] * 3] * 2,
        [[[10**400, 0, 0, 1]] * 3] * 2,
        [np.full(12, np.inf, "<f4").tobytes()] * 2,
    ],
)
def test_what_is_not_surely_right_is_left_to_the_gate(sent):
    assert pose_block(sent, [None, None], 3, "xyzw") is None


def test_a_mask_of_another_length_is_left_to_the_gate():
    assert pose_block(GOOD, [(True,) * 3, (True,) * 2], 3, "xyzw") is None
