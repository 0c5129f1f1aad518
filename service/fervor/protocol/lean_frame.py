"""The frames that come by the thousand: joints as raw float32 in MessagePack, and nothing unusual about them.

They are decoded straight into structures, so that the joints of many can be checked and adapted in one block. A message
that is anything else, or not surely right, is left to `fervor.protocol.codec`, which alone says what is wrong.
"""

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Annotated, ClassVar, Literal

import msgspec
from msgspec import Meta, Struct

from fervor.protocol.messages import MOST_FRAMES, MOST_LABELS, Frame, Raw
from fervor.protocol.trusted import trusted

_Label = Annotated[str, Meta(max_length=32)]


class LeanFrame(Struct, tag_field="type", tag="frame", forbid_unknown_fields=True, frozen=True, gc=False):
    """A `Frame` with raw joints in `q`, and no mask."""

    type: ClassVar[Literal["frame"]] = "frame"
    seq: Annotated[int, Meta(ge=0, le=2**53)]
    q: bytes  # float32, little-endian
    body: Annotated[str, Meta(min_length=1, max_length=64)] = "0"
    t: float | None = None  # seconds, client clock
    emotion: _Label | Annotated[dict[_Label, float], Meta(max_length=MOST_LABELS)] | None = None

    def to_frame(self) -> Frame:
        """The same as any other frame."""
        fields: Mapping[str, object] = {
            "type": "frame",
            "body": self.body,
            "seq": self.seq,
            "t": self.t,
            "q": trusted(Raw, {"root": self.q}),
            "p": None,
            "mask": None,
            "emotion": self.emotion,
        }
        return trusted(Frame, dict(fields))


class LeanFrames(Struct, tag_field="type", tag="frames", forbid_unknown_fields=True, frozen=True, gc=False):
    """A `Frames` of nothing but such."""

    type: ClassVar[Literal["frames"]] = "frames"
    frames: Annotated[tuple[LeanFrame, ...], Meta(min_length=1, max_length=MOST_FRAMES)]


_decode: Callable[[bytes], LeanFrame | LeanFrames] = msgspec.msgpack.Decoder(LeanFrame | LeanFrames).decode


def lean_frames(data: bytes) -> LeanFrame | LeanFrames | None:
    """The message in MessagePack; None if it is another one, or not surely right."""
    try:
        came = _decode(data)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None
    frames = (came,) if isinstance(came, LeanFrame) else came.frames
    return came if all(frame.t is None or isfinite(frame.t) for frame in frames) else None
