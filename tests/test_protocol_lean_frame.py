"""A lean frame holds what a message has, and nothing that a message may not have."""

import msgspec
import pytest

from fervor.protocol.lean_frame import LeanFrame, LeanFrames, LeanJsonFrame
from fervor.protocol.messages import Frame, Frames, Raw

FIELDS = {"body": "eve", "seq": 7, "t": 0.5, "mask": (True, False), "emotion": {"joy": 0.5}}
JOINTS = ((0.0, 0.0, 0.0, 1.0), None)


@pytest.mark.parametrize("kind", [LeanFrame, LeanJsonFrame])
def test_the_same_as_any_other_frame(kind: type[LeanFrame]) -> None:
    lean, frame = kind(q=JOINTS, **FIELDS), Frame(q=JOINTS, **FIELDS)
    assert lean.to_message() == frame
    assert repr(lean.to_message()) == repr(frame)
    assert (lean.type, kind(seq=1).to_message()) == ("frame", Frame(seq=1))


def test_raw_joints_are_wrapped() -> None:
    lean = LeanFrame(q=b"1234", p=b"", **FIELDS)
    assert lean.to_message() == Frame(q=Raw(b"1234"), p=Raw(b""), **FIELDS)


def test_several() -> None:
    lean = LeanFrames((LeanFrame(seq=1), LeanFrame(seq=2, q=JOINTS)))
    assert lean.to_message() == Frames(frames=(Frame(seq=1), Frame(seq=2, q=JOINTS)))
    assert lean.type == "frames"


@pytest.mark.parametrize("time", [float("nan"), float("inf"), float("-inf")])
def test_a_time_is_finite(time: float) -> None:
    packed = msgspec.msgpack.encode({"type": "frame", "seq": 1, "t": time})
    with pytest.raises(msgspec.ValidationError, match=r"\$\.t"):
        msgspec.msgpack.decode(packed, type=LeanFrame)


def test_raw_joints_are_none_of_json() -> None:
    with pytest.raises(msgspec.ValidationError, match=r"\$\.q"):
        msgspec.json.decode('{"type":"frame","seq":1,"q":"AAAA"}', type=LeanJsonFrame)
