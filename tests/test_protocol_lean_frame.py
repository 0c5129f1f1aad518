"""Raw frames are those that the plain path decodes; what it refuses, and whatever is unusual, is left to it."""

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.protocol.codec import MsgpackCodec
from fervor.protocol.lean_frame import LeanFrame, LeanFrames, lean_frames
from fervor.protocol.messages import Frame, Frames

codec = MsgpackCodec()

emotions = st.none() | st.text(max_size=32) | st.dictionaries(st.text(max_size=32), st.floats(0, 1), max_size=3)
usual = st.fixed_dictionaries(
    {"type": st.just("frame"), "seq": st.integers(0, 2**53), "q": st.binary(max_size=64)},
    optional={
        "body": st.text(min_size=1, max_size=64),
        "t": st.none() | st.floats(allow_nan=False, allow_infinity=False) | st.integers(-9, 9),
        "emotion": emotions,
    },
)


def as_message(raw: LeanFrame | LeanFrames) -> Frame | Frames:
    return (
        raw.to_frame() if isinstance(raw, LeanFrame) else Frames(frames=tuple(each.to_frame() for each in raw.frames))
    )


@given(message=usual)
def test_a_usual_frame_is_that_of_the_plain_path(message) -> None:
    data = msgpack.packb(message)
    raw = lean_frames(data)
    assert isinstance(raw, LeanFrame)
    assert repr(as_message(raw)) == repr(codec.decode_client(data))


@given(messages=st.lists(usual, min_size=1, max_size=4))
def test_so_are_several(messages) -> None:
    data = msgpack.packb({"type": "frames", "frames": messages})
    raw = lean_frames(data)
    assert isinstance(raw, LeanFrames)
    assert as_message(raw) == codec.decode_client(data)


@pytest.mark.parametrize(
    "change",
    [
        {"mask": [True]},
        {"p": b"", "q": None},
        {"q": [[0.0, 0.0, 0.0, 1.0]]},
        {"q": None},
        {"t": float("nan")},
        {"t": float("inf")},
        {"seq": -1},
        {"seq": True},
        {"body": ""},
        {"more": 1},
        {"type": "ping"},
    ],
)
def test_what_is_unusual_or_wrong_is_left_to_the_plain_path(change) -> None:
    frame = {"type": "frame", "seq": 1, "t": 0.0, "q": b"", **change}
    assert lean_frames(msgpack.packb(frame)) is None
    if change.get("type") is None:
        assert lean_frames(msgpack.packb({"type": "frames", "frames": [frame]})) is None


@given(data=st.binary(max_size=60))
def test_no_bytes_raise(data: bytes) -> None:
    for head in (b"", b"\x83\xa4type\xa5frame\xa3seq\x01"):
        raw = lean_frames(head + data)
        assert raw is None or as_message(raw) == codec.decode_client(head + data)
