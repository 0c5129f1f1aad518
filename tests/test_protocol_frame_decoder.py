"""Frames decoded without pydantic are those that pydantic decodes; what it refuses is never taken."""

import json
from unittest.mock import patch

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.errors import MessageError
from fervor.protocol import codec
from fervor.protocol.codec import CODECS, JsonCodec, MsgpackCodec
from fervor.protocol.frame_decoder import frames_from_json, frames_from_msgpack
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import Frame, Frames

numbers = st.floats(allow_nan=False, allow_infinity=False)
labels = st.sampled_from(["joy", "unknown", "nobody knows", "x" * 32])
quaternions = st.lists(st.none() | st.tuples(*[numbers | st.integers(-9, 9)] * 4), max_size=4)
vectors = st.lists(st.none() | st.tuples(numbers, numbers, numbers), max_size=4)


def optional(**fields):
    return st.fixed_dictionaries({}, optional=fields)


right = optional(
    body=st.text(min_size=1, max_size=64),
    t=numbers | st.integers(0, 2**64 - 1) | st.none(),
    q=quaternions | st.none(),
    p=vectors | st.none(),
    mask=st.lists(st.booleans(), max_size=4) | st.none(),
    emotion=labels | st.dictionaries(labels, numbers, max_size=3) | st.none(),
)
raw = optional(q=st.binary(max_size=64), p=st.binary(max_size=64))
seqs = st.integers(0, 2**53)

strange = [None, True, "", "5", "x" * 65, -1, 2**53 + 1, 1.0, 1e300, b"", [], [None], [1, 2, 3], {}, {"joy": True}]
anything = st.sampled_from([*strange, "frame"]) | st.floats()
wrong = st.dictionaries(st.sampled_from(["body", "t", "q", "p", "mask", "emotion", "seq", "type", "more"]), anything)


def frames(fields):
    return st.builds(lambda seq, given: {"type": "frame", "seq": seq, **given}, seqs, fields)


def messages(fields):
    several = st.lists(frames(fields), max_size=3).map(lambda each: {"type": "frames", "frames": each})
    return frames(fields) | several


def fully(lean: LeanFrame | LeanFrames | None) -> Frame | Frames | None:
    return lean and lean.to_message()


def plainly(kind: str, data: str | bytes) -> object:
    """What the plain path makes of it: a message, or the sentence of its refusal."""
    name = "frames_from_json" if kind == JsonCodec.subprotocol else "frames_from_msgpack"
    with patch.object(codec, name, lambda _: None):
        return told(kind, data)


def told(kind: str, data: str | bytes) -> object:
    try:
        return CODECS[kind].decode_client(data)
    except MessageError as error:
        return type(error), error.message


def same(one: object, other: object) -> bool:
    """Whether two decoded messages are equal, types and the bits of floats included."""
    if isinstance(one, Frame | Frames) and isinstance(other, Frame | Frames):
        return repr(one) == repr(other)
    return one == other


@given(message=messages(right))
def test_json_frames_are_those_of_the_plain_path(message) -> None:
    text = json.dumps(message)
    fast = fully(frames_from_json(text))
    if message.get("frames") != []:
        assert same(fast, plainly(JsonCodec.subprotocol, text))
    else:
        assert fast is None


spelt = st.from_regex(r"-?(0|[1-9][0-9]{0,24})(\.[0-9]{1,40})?([eE][+-]?[0-9]{1,3})?", fullmatch=True)
spelt_oddly = st.sampled_from(["-0", "-0.0", "0e9", "1E+2", "1e999", "-1e999", "1e-999", "01", "+1", ".5", "1.", "NaN"])


@given(number=spelt | spelt_oddly)
def test_numbers_are_those_of_the_plain_path_however_they_are_spelt(number: str) -> None:
    for text in ('{"type":"frame","seq":1,"t":%s}', '{"type":"frame","seq":1,"q":[[%s,0,0,1]],"p":[null,[1,%s,0]]}'):
        message = text.replace("%s", number)
        assert same(told(JsonCodec.subprotocol, message), plainly(JsonCodec.subprotocol, message))


@given(message=messages(right) | messages(raw))
def test_packed_frames_are_those_of_the_plain_path(message) -> None:
    data = msgpack.packb(message)
    fast = fully(frames_from_msgpack(data))
    if message.get("frames") != []:
        assert same(fast, plainly(MsgpackCodec.subprotocol, data))
    else:
        assert fast is None


@given(message=messages(right), spoilt=wrong, both=st.booleans())
def test_what_is_wrong_is_told_as_on_the_plain_path(message, spoilt, both: bool) -> None:
    spoiled = {**message, **spoilt}
    if both and message.get("frames"):
        spoiled = {**message, "frames": [{**frame, **spoilt} for frame in message["frames"]]}
    data = msgpack.packb(spoiled)
    assert same(told(MsgpackCodec.subprotocol, data), plainly(MsgpackCodec.subprotocol, data))
    text = json.dumps(spoiled, default=lambda value: value.decode())
    assert same(told(JsonCodec.subprotocol, text), plainly(JsonCodec.subprotocol, text))


@given(data=st.binary(max_size=60))
def test_no_bytes_are_taken_that_the_plain_path_refuses(data: bytes) -> None:
    for head in (b"", b"\x83\xa4type\xa5frame\xa3seq\x01"):
        taken = fully(frames_from_msgpack(head + data))
        assert taken is None or same(taken, plainly(MsgpackCodec.subprotocol, head + data))


@pytest.mark.parametrize("text", ['{"type":"ping"}', '{"type":"session.start"}', "[" * 100_000, "", "{}"])
def test_other_messages_are_left_to_the_plain_path(text: str) -> None:
    assert frames_from_json(text) is None


def test_a_frame_in_frames_may_say_its_type() -> None:
    text = '{"type":"frames","frames":[{"type":"frame","seq":1},{"seq":2}]}'
    assert fully(frames_from_json(text)) == Frames(frames=(Frame(seq=1), Frame(seq=2)))
