"""The messages that come thirty times a second, `frame` and `frames`, as structures that cost next to nothing.

They hold what `fervor.protocol.messages` has, right by construction: see `fervor.protocol.frame_decoder`.
"""

import sys
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta, Struct

from fervor.protocol.messages import MOST_FRAMES, MOST_LABELS, Frame, Frames, Raw
from fervor.protocol.skeleton_spec import MOST_JOINTS
from fervor.protocol.trusted import trusted

# The types of fervor.protocol.messages once more, as msgspec says them; a test compares the two.

_Label = Annotated[str, Meta(max_length=32)]
LeanEmotion = _Label | Annotated[dict[_Label, float], Meta(max_length=MOST_LABELS)]
LeanQuaternions = Annotated[tuple[tuple[float, float, float, float] | None, ...], Meta(max_length=MOST_JOINTS)]
LeanVectors = Annotated[tuple[tuple[float, float, float] | None, ...], Meta(max_length=MOST_JOINTS)]
LeanMask = Annotated[tuple[bool, ...], Meta(max_length=MOST_JOINTS)]
_Finite = Annotated[float, Meta(ge=-sys.float_info.max, le=sys.float_info.max)]


class LeanFrame(Struct, tag_field="type", tag="frame", forbid_unknown_fields=True, frozen=True, gc=False):
    """A `Frame`, as it comes in MessagePack."""

    type: ClassVar[Literal["frame"]] = "frame"
    seq: Annotated[int, Meta(ge=0, le=2**53)]
    body: Annotated[str, Meta(min_length=1, max_length=64)] = "0"
    t: _Finite | None = None  # seconds, client clock
    q: bytes | LeanQuaternions | None = None  # bytes: float32, little-endian
    p: bytes | LeanVectors | None = None
    mask: LeanMask | None = None
    emotion: LeanEmotion | None = None

    def to_message(self) -> Frame:
        """The same as any other message."""
        fields = {
            "type": "frame",
            "body": self.body,
            "seq": self.seq,
            "t": self.t,
            "q": _wrapped(self.q),
            "p": _wrapped(self.p),
            "mask": self.mask,
            "emotion": self.emotion,
        }
        return trusted(Frame, fields)


class LeanJsonFrame(LeanFrame, tag="frame", frozen=True, gc=False):
    """A `Frame`, as it comes in JSON."""

    q: LeanQuaternions | None = None
    p: LeanVectors | None = None


class LeanFrames(Struct, tag_field="type", tag="frames", forbid_unknown_fields=True, frozen=True, gc=False):
    """A `Frames`, as it comes in MessagePack."""

    type: ClassVar[Literal["frames"]] = "frames"
    frames: Annotated[tuple[LeanFrame, ...], Meta(min_length=1, max_length=MOST_FRAMES)]

    def to_message(self) -> Frames:
        """The same as any other message."""
        return trusted(Frames, {"type": "frames", "frames": tuple(frame.to_message() for frame in self.frames)})


class LeanJsonFrames(LeanFrames, tag="frames", frozen=True, gc=False):
    """A `Frames`, as it comes in JSON."""

    frames: Annotated[tuple[LeanJsonFrame, ...], Meta(min_length=1, max_length=MOST_FRAMES)]


def _wrapped(joints: Any) -> Any:
    return trusted(Raw, {"root": joints}) if isinstance(joints, bytes) else joints
