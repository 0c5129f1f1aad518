"""The bodies of `/v1/score`, JSON or MessagePack: what they ask for, and the takes that they bring.

msgspec reads the frames straight into the types they must have. What it does not take, pydantic decodes, or refuses
with a sentence; so one place alone says what is wrong.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import msgpack
import msgspec
import numpy as np
from msgspec import Meta, Struct
from pydantic import ValidationError

from fervor.errors import FrameError, RequestError
from fervor.protocol.codec import one_sentence
from fervor.protocol.lean_frame import LeanEmotion, LeanMask, LeanQuaternions, LeanVectors
from fervor.protocol.messages import Frame, Raw
from fervor.protocol.trusted import trusted
from fervor.scoring.take import Take
from fervor.server.scoring_models import (
    PackedScoreFrame,
    PackedScoreRequest,
    PackedScoreSequence,
    ScoreFrame,
    ScoreRequest,
    ScoreSequence,
    ScoreTerms,
)
from fervor.session.start import Agreement

MSGPACK = ("application/msgpack", "application/vnd.msgpack", "application/x-msgpack")
"""Content types of MessagePack; the first one is what we call it."""

# The types of fervor.server.scoring_models once more, as msgspec says them; a test compares the two.


class _JsonFrame(Struct, forbid_unknown_fields=True, gc=False):
    t: float | None = None
    q: LeanQuaternions | None = None
    p: LeanVectors | None = None
    mask: LeanMask | None = None


class _PackedFrame(Struct, forbid_unknown_fields=True, gc=False):
    t: float | None = None
    q: bytes | LeanQuaternions | None = None
    p: bytes | LeanVectors | None = None
    mask: LeanMask | None = None


class _JsonSequence(Struct, forbid_unknown_fields=True):
    frames: Annotated[tuple[_JsonFrame, ...], Meta(min_length=1)]
    name: Annotated[str, Meta(max_length=256)] = ""
    emotion: LeanEmotion | None = None


class _PackedSequence(Struct, forbid_unknown_fields=True):
    frames: Annotated[tuple[_PackedFrame, ...], Meta(min_length=1)]
    name: Annotated[str, Meta(max_length=256)] = ""
    emotion: LeanEmotion | None = None


AskedFrame = ScoreFrame | PackedScoreFrame | _JsonFrame | _PackedFrame
AskedSequence = ScoreSequence | PackedScoreSequence | _JsonSequence | _PackedSequence

_Parts = dict[str, msgspec.Raw]

_json_parts: Callable[[bytes], _Parts] = msgspec.json.Decoder(_Parts).decode
_json_sequences: Callable[[msgspec.Raw], tuple[_JsonSequence, ...]] = msgspec.json.Decoder(
    Annotated[tuple[_JsonSequence, ...], Meta(min_length=1)]
).decode
_packed_parts: Callable[[bytes], _Parts] = msgspec.msgpack.Decoder(_Parts).decode
_packed_sequences: Callable[[msgspec.Raw], tuple[_PackedSequence, ...]] = msgspec.msgpack.Decoder(
    Annotated[tuple[_PackedSequence, ...], Meta(min_length=1)]
).decode


@dataclass(frozen=True, slots=True)
class Asked:
    """What a request asks for."""

    terms: ScoreTerms
    sequences: Sequence[AskedSequence]

    @property
    def frames(self) -> int:
        """Over all sequences."""
        return sum(len(sequence.frames) for sequence in self.sequences)


def read_request(body: bytes, content_type: str) -> Asked:
    """What a body asks for; it is JSON unless its type says MessagePack.

    Raises:
        RequestError: it can't be used; says which field is wrong and what was expected.
    """
    packed = content_type.partition(";")[0].strip().lower() in MSGPACK
    try:
        return (_packed_quickly if packed else _json_quickly)(body) or (_packed if packed else _json)(body)
    except ValidationError as error:
        raise RequestError(one_sentence(error)) from None


def _json_quickly(body: bytes) -> Asked | None:
    """A request in JSON; None if it is not surely right."""
    try:
        parts = _json_parts(body)
        sequences = _json_sequences(parts.pop("sequences"))
        rest = msgspec.json.encode(parts)
    except (KeyError, msgspec.MsgspecError, UnicodeError, RecursionError):
        return None
    return Asked(ScoreTerms.model_validate_json(rest, strict=True), sequences)


def _packed_quickly(body: bytes) -> Asked | None:
    """A request in MessagePack; None if it is not surely right."""
    try:
        parts = _packed_parts(body)
        sequences = _packed_sequences(parts.pop("sequences"))
        rest = {name: msgspec.msgpack.decode(part) for name, part in parts.items()}
    except (KeyError, msgspec.MsgspecError, UnicodeError, RecursionError):
        return None
    if not np.isfinite([frame.t for sequence in sequences for frame in sequence.frames if frame.t is not None]).all():
        return None
    return Asked(ScoreTerms.model_validate(rest), sequences)


def _json(body: bytes) -> Asked:
    request = ScoreRequest.model_validate_json(body, strict=True)
    return Asked(request, request.sequences)


def _packed(body: bytes) -> Asked:
    try:
        unpacked: Any = msgpack.unpackb(body, use_list=False)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise RequestError(f"the message is not MessagePack: {error or type(error).__name__}") from None
    request = PackedScoreRequest.model_validate(unpacked)
    return Asked(request, request.sequences)


def take_of(number: int, sequence: AskedSequence, agreement: Agreement) -> Take:
    """The frames of a sequence as arrays, through the gate that live frames pass.

    Raises:
        RequestError: a frame is poisoned, or has no time where it needs one.
    """
    name = sequence.name or f"sequence {number}"
    try:
        return _take_quickly(name, sequence, agreement) or _take(name, sequence, agreement)
    except FrameError as error:
        raise RequestError(error.message) from None


def _take_quickly(name: str, sequence: AskedSequence, agreement: Agreement) -> Take | None:
    """All frames at once; None if some have no time or are not surely right."""
    frames: Sequence[AskedFrame] = sequence.frames
    times = [frame.t for frame in frames]
    block = agreement.layout.read(frames)
    if None in times or block.doubtful:
        return None
    return Take(name, np.array(times, np.float64), block.joints, block.observed, sequence.emotion)


def _take(name: str, sequence: AskedSequence, agreement: Agreement) -> Take:
    """Frame by frame."""
    times, joints, observed = [], [], []
    frames: Sequence[AskedFrame] = sequence.frames
    for seq, sent in enumerate(frames):
        fields = {"q": _wrapped(sent.q), "p": _wrapped(sent.p), "t": sent.t, "mask": sent.mask}
        frame = Frame.model_construct(body=name, seq=seq, **fields)
        times.append(agreement.time_of(frame))
        pose = agreement.pose_of(frame)
        joints.append(pose.joints)
        observed.append(pose.observed)
    return Take(name, np.array(times), np.stack(joints), np.stack(observed), sequence.emotion)


def _wrapped(joints: Any) -> Any:
    return trusted(Raw, {"root": joints}) if isinstance(joints, bytes) else joints
