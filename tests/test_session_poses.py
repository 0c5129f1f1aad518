"""Poses read in blocks are those read one by one, to the bit, and so are the sentences on poisoned ones."""

import json
from unittest.mock import patch

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bodies import model, motion
from fervor.errors import FervorError, FrameError
from fervor.protocol import codec
from fervor.protocol.codec import Codec, JsonCodec, MsgpackCodec
from fervor.protocol.lean_frame import LeanFrame, LeanJsonFrame
from fervor.protocol.messages import Frame, SessionStart
from fervor.session.events import Pose
from fervor.session.poses import read_poses
from fervor.session.start import Agreement, agree

STARTS = [
    SessionStart(skeleton="c13"),
    SessionStart(skeleton="c13", quaternion="wxyz"),
    SessionStart(skeleton="c13", joints=("r_elbow", "spine", "head")),
    SessionStart(skeleton="kinect_v2"),
    SessionStart(skeleton="mediapipe"),
    SessionStart(skeleton="coco17", joints=("left_elbow", "nose", "right_hip")),
]
AGREEMENTS = [agree(start, model().metadata) for start in STARTS]
SMALL = (2, 5)
"""Those of three joints."""


def plainly(agreement: Agreement, frame: LeanFrame | Frame) -> Pose | FrameError:
    try:
        return agreement.pose_of(frame.to_message() if isinstance(frame, LeanFrame) else frame)
    except FrameError as error:
        return error


def told(read: Pose | FervorError) -> object:
    if isinstance(read, Pose):
        return read.joints.tobytes(), read.joints.shape, read.observed.tolist(), read.lost
    return type(read), read.message, getattr(read, "body", None), getattr(read, "seq", None)


def spoilt(joints: np.ndarray, how: str) -> np.ndarray:
    match how:
        case "nan":
            joints[-1, 2] = np.nan
        case "long":
            joints[0] *= 3.0
        case "huge":
            joints[0] = 3e38
        case "untracked":
            joints[1] = 0.0
        case "short":
            joints[0] *= 0.4
        case "lost":
            joints[:] = 0.0
        case "fewer":
            joints = joints[1:]
    return joints


MASKS = {
    "masked": lambda joints: tuple(joint % 3 > 0 for joint in range(joints)),
    "unseen": lambda joints: (False,) * joints,
    "short mask": lambda _: (True,),
}


def frame(agreement: Agreement, seq: int, spoil: str, sent: str) -> LeanFrame:
    """A frame whose joints are `sent` as raw float32, arrays, or arrays in JSON."""
    layout = agreement.layout
    width = 4 if layout.rotations else 3
    joints = spoilt(motion(1, seed=seq, joints=layout.joints)[0, :, :width].astype("<f4"), spoil)
    values: object = joints.tobytes()
    if sent != "raw":
        values = tuple(map(tuple, joints.astype(np.float64).tolist()))
        if spoil == "null":
            values = (None, *values[1:])
    names = {"both": "qp", "neither": ""}.get(spoil, "q" if layout.rotations else "p")
    fields = {"mask": MASKS.get(spoil, lambda _: None)(layout.joints), **dict.fromkeys(names, values)}
    return (LeanJsonFrame if sent == "json" else LeanFrame)(seq=seq, t=0.0, **fields)


wrong = ["nan", "long", "huge", "fewer", "short mask", "both", "neither"]
unusual = ["untracked", "short", "lost", "null", "masked", "unseen"]
spoils = st.sampled_from(["", "", "", *wrong, *unusual])
ways = st.sampled_from(["raw", "arrays", "json"])


@given(st.lists(st.tuples(st.integers(0, len(STARTS) - 1), spoils, ways), max_size=20))
def test_a_block_gives_each_frame_what_it_gets_alone(kinds) -> None:
    frames = [(AGREEMENTS[kind], frame(AGREEMENTS[kind], seq, *how)) for seq, (kind, *how) in enumerate(kinds)]
    assert [told(read) for read in read_poses(frames)] == [told(plainly(*each)) for each in frames]


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("sent", [("raw",) * 3, ("arrays",) * 3, ("json",) * 3, ("json", "raw", "arrays")])
def test_frames_of_one_layout_share_a_block_whoever_sent_them(start, sent) -> None:
    frames = [
        (agreement, frame(agreement, seq, "masked" if seq else "", how))
        for seq, how in enumerate(sent)
        if (agreement := agree(start, model().metadata))
    ]
    poses = [read for read in read_poses(frames) if isinstance(read, Pose)]
    assert len({id(pose.block) for pose in poses}) == 1
    assert [pose.row for pose in poses] == [0, 1, 2]
    kept = poses[0].copy()
    assert kept.block is None
    assert told(kept) == told(poses[0])


# --- from what stands on the wire -------------------------------------------------------------------------------------

number = st.sampled_from([0, 0.5, 1, -1.0, 2, 1e9, 1e300]) | st.floats(-1.2, 1.2) | st.integers(-2, 2)
numbers = st.lists(number, min_size=3, max_size=4)
joints = st.lists(numbers | st.none(), min_size=3, max_size=3) | st.lists(numbers | st.none(), max_size=4)
right = st.lists(st.tuples(*[number] * 4), min_size=3, max_size=3)
points = st.lists(st.tuples(*[number] * 3), min_size=3, max_size=3)
mask = st.lists(st.booleans(), min_size=3, max_size=3) | st.lists(st.booleans() | st.none(), max_size=4)
odd = st.sampled_from([float("nan"), float("inf"), "x", "", True, 7, [], {}])
strange = st.dictionaries(st.sampled_from(["seq", "body", "t", "q", "p", "mask", "emotion", "type", "more"]), odd)


def raw(width: int) -> st.SearchStrategy[bytes]:
    values = st.sampled_from([0.0, 0.5, 1.0, 2.0]) | st.floats(width=32)
    packed = st.lists(values, min_size=3 * width, max_size=3 * width).map(lambda each: np.array(each, "<f4").tobytes())
    return packed | st.binary(min_size=12 * width, max_size=12 * width) | st.binary(max_size=60)


def messages(rotations: st.SearchStrategy, positions: st.SearchStrategy) -> st.SearchStrategy[dict]:
    """Frames, most of them right; in some, anything may be wrong."""
    frames = st.fixed_dictionaries(
        {"type": st.just("frame"), "seq": st.integers(0, 9)},
        optional={
            "body": st.text(max_size=3),
            "t": st.floats(0, 9) | st.none(),
            "q": rotations | joints | st.none(),
            "p": positions | joints | st.none(),
            "mask": mask | st.none(),
        },
    )
    return frames | st.builds(lambda message, more: {**message, **more}, frames, strange)


def in_blocks(wire: Codec, agreement: Agreement, sent: list[str | bytes]) -> list[object]:
    """What becomes of messages as a turn takes them."""
    lean = [wire.decode_frames(data) for data in sent]
    read = iter(read_poses([(agreement, each) for each in lean if isinstance(each, LeanFrame)]))
    return [
        told(next(read)) if each else one_by_one(wire, agreement, data) for each, data in zip(lean, sent, strict=True)
    ]


def one_by_one(wire: Codec, agreement: Agreement, data: str | bytes) -> object:
    """What becomes of one as pydantic decodes it."""
    nothing = {name: lambda _: None for name in ("frames_from_json", "frames_from_msgpack")}
    with patch.multiple(codec, **nothing):
        try:
            message = wire.decode_client(data)
        except FervorError as error:
            return told(error)
    return told(plainly(agreement, message)) if isinstance(message, Frame) else message


@given(sent=st.lists(messages(right, points), min_size=1, max_size=6), start=st.sampled_from(SMALL))
def test_every_json_text_becomes_what_the_plain_path_makes_of_it(sent, start) -> None:
    texts = [json.dumps(message) for message in sent]
    wire, agreement = JsonCodec(), AGREEMENTS[start]
    assert in_blocks(wire, agreement, texts) == [one_by_one(wire, agreement, text) for text in texts]


packed = messages(right | raw(4), points | raw(3))


@given(sent=st.lists(packed, min_size=1, max_size=6), start=st.sampled_from(SMALL))
def test_so_does_every_messagepack(sent, start) -> None:
    wire, agreement = MsgpackCodec(), AGREEMENTS[start]
    data = [msgpack.packb(message) for message in sent]
    assert in_blocks(wire, agreement, data) == [one_by_one(wire, agreement, each) for each in data]
