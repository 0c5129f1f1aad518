"""The messages that come thirty times a second, `frame` and `frames`, decoded without pydantic.

msgspec reads them straight into the types they must have, and is stricter than the plain path of
`fervor.protocol.codec`: it takes a message only if all of it is right. What it does not take, the plain path decodes,
or refuses with a sentence; so one place alone says what is wrong.
"""

from collections.abc import Callable
from math import isfinite
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from fervor.protocol.messages import MOST_FRAMES, MOST_LABELS, Frame, Frames, Raw
from fervor.protocol.skeleton_spec import MOST_JOINTS
from fervor.protocol.trusted import trusted

# The types of fervor.protocol.messages once more, as msgspec says them; a test compares the two decoders.

_Label = Annotated[str, Meta(max_length=32)]
_Emotion = _Label | Annotated[dict[_Label, float], Meta(max_length=MOST_LABELS)]
_Quaternions = Annotated[tuple[tuple[float, float, float, float] | None, ...], Meta(max_length=MOST_JOINTS)]
_Vectors = Annotated[tuple[tuple[float, float, float] | None, ...], Meta(max_length=MOST_JOINTS)]
_Mask = Annotated[tuple[bool, ...], Meta(max_length=MOST_JOINTS)]


class _Common(Struct, tag_field="type", tag="frame", forbid_unknown_fields=True, gc=False):
    seq: Annotated[int, Meta(ge=0, le=2**53)]
    body: Annotated[str, Meta(min_length=1, max_length=64)] = "0"
    t: float | None = None
    mask: _Mask | None = None
    emotion: _Emotion | None = None


class _JsonFrame(_Common, tag="frame"):
    q: _Quaternions | None = None
    p: _Vectors | None = None


class _PackedFrame(_Common, tag="frame"):
    q: bytes | _Quaternions | None = None
    p: bytes | _Vectors | None = None


class _JsonFrames(Struct, tag_field="type", tag="frames", forbid_unknown_fields=True, gc=False):
    frames: Annotated[tuple[_JsonFrame, ...], Meta(min_length=1, max_length=MOST_FRAMES)]


class _PackedFrames(Struct, tag_field="type", tag="frames", forbid_unknown_fields=True, gc=False):
    frames: Annotated[tuple[_PackedFrame, ...], Meta(min_length=1, max_length=MOST_FRAMES)]


_Came = _JsonFrame | _JsonFrames | _PackedFrame | _PackedFrames

_from_json: Callable[[str], _Came] = msgspec.json.Decoder(_JsonFrame | _JsonFrames).decode
_from_msgpack: Callable[[bytes], _Came] = msgspec.msgpack.Decoder(_PackedFrame | _PackedFrames).decode


def frames_from_json(text: str) -> Frame | Frames | None:
    """The message in a JSON text; None if it is another one, or not surely right."""
    try:
        return _message(_from_json(text))
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None


def frames_from_msgpack(data: bytes) -> Frame | Frames | None:
    """The message in MessagePack; None if it is another one, or not surely right."""
    try:
        return _message(_from_msgpack(data))
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None


def _message(came: _Came) -> Frame | Frames | None:
    if isinstance(came, _JsonFrame | _PackedFrame):
        return _frame(came)
    frames = tuple(frame for each in came.frames if (frame := _frame(each)) is not None)
    return trusted(Frames, {"type": "frames", "frames": frames}) if len(frames) == len(came.frames) else None


def _frame(came: _JsonFrame | _PackedFrame) -> Frame | None:
    t, q, p = came.t, came.q, came.p
    if t is not None and not isfinite(t):
        return None
    fields = {
        "type": "frame",
        "body": came.body,
        "seq": came.seq,
        "t": t,
        "q": trusted(Raw, {"root": q}) if isinstance(q, bytes) else q,
        "p": trusted(Raw, {"root": p}) if isinstance(p, bytes) else p,
        "mask": came.mask,
        "emotion": came.emotion,
    }
    return trusted(Frame, fields)
