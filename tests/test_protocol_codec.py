"""Bad bytes get one clear sentence."""

import contextlib

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from fervor.errors import MessageError
from fervor.protocol.codec import JsonCodec, MsgpackCodec
from fervor.protocol.messages import ClientMessage, Estimate, Frame, Raw

CODEC = JsonCodec()

NONSENSE = 20_000


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        ('{"type":"frame","seq":1,"q":[' + "[]," * NONSENSE + "[]]}", 6),
        ('{"type":"frame","seq":1,"q":[' + "1," * NONSENSE + "1]}", 3),
        ('{"type":"frame","seq":1,"p":[' + "[1]," * NONSENSE + "1]}", 4),
        ('{"type":"frame","seq":1,"mask":[' + "1," * NONSENSE + "1]}", 1),
        ('{"type":"frames","frames":[' + "{}," * NONSENSE + "{}]}", 2),
        ('{"type":"frames","frames":[' + '{"seq":1},' * NONSENSE + '{"seq":1}]}', 1),
        ('{"type":"session.start","joints":[' + "1," * NONSENSE + "1]}", 1),
        ('{"type":"session.start","resume":[' + "1," * NONSENSE + "1]}", 1),
    ],
)
def test_nonsense_is_not_told_one_by_one(text: str, mistakes: int) -> None:
    """A megabyte of it would take tens of seconds, in which nobody else is served."""
    with pytest.raises(ValidationError) as raised:
        TypeAdapter(ClientMessage).validate_json(text, strict=True)
    assert raised.value.error_count() <= mistakes


def test_a_huge_input_is_shown_in_few_words() -> None:
    with pytest.raises(MessageError) as raised:
        CODEC.decode_client('{"type":"frame","seq":1,"emotion":{' + ",".join(f'"{n}":1' for n in range(5000)) + "}}")
    assert len(raised.value.message) < 200


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "the message is not JSON: EOF"),
        ("[]", "should be an object"),
        ('{"type":"x"}', "type is not known"),
        ("{}", "type"),
        ('{"type":"session.start","skeletn":"c13"}', "session.start.skeletn is not a field of this message"),
        ('{"type":"frame","t":0,"q":[]}', "frame.seq is missing"),
        ('{"type":"frame","seq":"3","t":0,"q":[]}', "frame.seq: input should be a valid integer, but '3' came"),
        ('{"type":"frame","seq":-1,"t":0,"q":[]}', "greater than or equal to 0, but -1 came"),
        ('{"type":"frame","seq":1,"t":0,"q":[[1,2,3]]}', "frame.q.0.3 is missing"),
        ('{"type":"frame","seq":1,"t":NaN,"q":[]}', "frame.t: input should be a finite number"),
        ('{"type":"frame","seq":1,"t":1,"q":[],"emotion":3}', "frame.emotion"),
        ('{"type":"frames","frames":[]}', "at least 1 item"),
        ('{"type":"body.reset","body":""}', "at least 1 character"),
        ("\ud800", "unable to parse raw data as a unicode string"),
    ],
)
def test_one_sentence_names_the_field(text, told):
    with pytest.raises(MessageError) as caught:
        CODEC.decode_client(text)
    assert told in caught.value.message
    assert "\n" not in caught.value.message
    assert len(caught.value.message) < 300


def test_binary_on_the_text_subprotocol_is_told():
    with pytest.raises(MessageError, match="takes text messages, but 3 bytes of binary came"):
        CODEC.decode_client(b"{} ")


@given(st.text(max_size=200))
def test_no_text_raises_anything_else(text):
    with contextlib.suppress(MessageError):
        CODEC.decode_client(text)


def test_nulls_that_mean_something_are_kept():
    estimate = Estimate(body="0", seq=1, t=0.0, intensity=None, level=None, emotion="joy", status="insufficient")
    assert '"intensity":null' in CODEC.encode(estimate)
    assert "null" in CODEC.encode(Frame(seq=1, t=0.0, q=(None,)))


PACKED = MsgpackCodec()


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "the message is not MessagePack"),
        (b"\xc1", "the message is not MessagePack"),
        (msgpack.packb([]), "valid dictionary"),
        (msgpack.packb({"type": "frame", "seq": 1, "t": 0.0, "q": "text"}), "frame.q: input should be a valid"),
        (msgpack.packb({"type": "frame", "seq": 1, "t": 0.0, "q": [], "x": 1}), "frame.x is not a field"),
        (b"\xdf" + b"\xff" * 4, "the message is not MessagePack"),
    ],
)
def test_bad_msgpack_is_told(data, told):
    with pytest.raises(MessageError) as caught:
        PACKED.decode_client(data)
    assert told in caught.value.message
    assert "\n" not in caught.value.message


def test_text_on_the_binary_subprotocol_is_told():
    with pytest.raises(MessageError, match="takes binary messages, but 2 characters"):
        PACKED.decode_client("{}")


@given(st.binary(max_size=200))
def test_no_bytes_raise_anything_else(data):
    with contextlib.suppress(MessageError):
        PACKED.decode_client(data)


def test_raw_joints_round_trip():
    frame = Frame(seq=1, t=0.0, q=Raw(b"1234" * 8))
    assert PACKED.decode_client(PACKED.encode(frame)) == frame
    with pytest.raises(MessageError, match=r"frame\.q: input should be a valid"):
        CODEC.decode_client('{"type":"frame","seq":1,"t":0,"q":"12341234"}')


@pytest.mark.parametrize(
    ("codec", "data"),
    [
        (CODEC, '{"type":"frame","seq":1,"q":[null]}'),
        (CODEC, '{"type":"frames","frames":[{"seq":1,"mask":[true]}]}'),
        (PACKED, PACKED.encode(Frame(seq=1, q=Raw(b"1234")))),
        (PACKED, msgpack.packb({"type": "frames", "frames": [{"seq": 1, "p": [[0.0, 0.0, 0.0]]}]})),
    ],
)
def test_frames_are_had_lean_and_as_messages(codec, data):
    lean = codec.decode_frames(data)
    assert lean.to_message() == codec.decode_client(data)


@pytest.mark.parametrize(
    ("codec", "data"),
    [
        (CODEC, '{"type":"ping"}'),
        (CODEC, '{"type":"frame","seq":-1}'),
        (CODEC, b"{}"),
        (PACKED, msgpack.packb({"type": "ping"})),
        (PACKED, msgpack.packb({"type": "frame", "seq": -1})),
        (PACKED, "{}"),
    ],
)
def test_nothing_else_is_a_frame(codec, data):
    assert codec.decode_frames(data) is None
