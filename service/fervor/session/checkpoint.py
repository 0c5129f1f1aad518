"""A checkpoint: all that is needed to go on with a body as if nothing had happened, as bytes.

MessagePack, whose floats are float64 as Python's: bookkeeping, the answers to the newest frames, and the engine's
arrays raw, little-endian. Long ones are deflated; those of a usual session are not, for that would cost a tenth of what
a second's frames do. Bound to the model file, the protocol and the terms of the session: a state makes no sense under
others. Who may make and read one is not decided here; see `fervor.session.sealing`.
"""

import hashlib
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from fervor.errors import CheckpointMismatch, CheckpointUnknown
from fervor.levels import Level
from fervor.protocol.messages import PROTOCOL, Flag
from fervor.session.answers import Answers

FORMAT = 4
"""Version of these bytes."""

MOST_PLAIN = 8192
"""Bytes above which a checkpoint is deflated: with a window, or intensities under every emotion."""

Arrays = Mapping[str, npt.NDArray[np.generic]]


class Memory(msgspec.Struct, frozen=True, eq=False, gc=False):
    """What the engine holds of one body: arrays by name, copied."""

    arrays: Arrays


class Bookkeeping(msgspec.Struct, frozen=True, array_like=True, gc=False):
    """What a body holds of itself, right after its frame `newest_seq`."""

    name: str
    newest_seq: int
    timeline: tuple[float, float, int] | None  # origin s, last s, steps
    last: float | None  # seconds
    label: tuple[tuple[float, ...], str, float | None]  # vector [emotion], name, until s
    pending: tuple[Flag, ...]
    level: tuple[Level, float] | None  # level, since s
    emotion: str


class _Array(msgspec.Struct, frozen=True, array_like=True, gc=False):
    dtype: str
    shape: tuple[int, ...]
    content: bytes


class _Content(msgspec.Struct, frozen=True, array_like=True, gc=False):
    format: int
    protocol: str
    model: str
    fingerprint: str
    terms: str
    body: Bookkeeping
    answers: tuple[bytes, ...]
    memory: dict[str, _Array]


_PLAIN = bytes([0x90 | len(_Content.__struct_fields__)])
"""How a content begins that is not deflated: as a MessagePack array of so many entries."""

_encode = msgspec.msgpack.Encoder().encode
_decode = msgspec.msgpack.Decoder(_Content).decode


@dataclass(frozen=True, slots=True)
class Bond:
    """What a checkpoint is bound to."""

    model: str
    """sha256 of the model file."""
    fingerprint: str
    terms: str
    """Digest of what the session agreed on."""


@dataclass(frozen=True, slots=True)
class Opened:
    """A checkpoint that was read again."""

    body: Bookkeeping
    answers: Answers
    memory: Memory
    same_runtime: bool


def pack(bond: Bond, body: Bookkeeping, answers: tuple[bytes, ...], memory: Memory) -> bytes:
    """The bytes of a checkpoint."""
    arrays = {name: _flattened(array) for name, array in memory.arrays.items()}
    content = _Content(FORMAT, PROTOCOL, bond.model, bond.fingerprint, bond.terms, body, answers, arrays)
    plain = _encode(content)
    return plain if len(plain) <= MOST_PLAIN else zlib.compress(plain, level=1)


def unpack(data: bytes, bond: Bond) -> Opened:
    """Read the bytes of a checkpoint for a session bound to `bond`.

    Raises:
        CheckpointUnknown: these are no bytes of a checkpoint, or of another format or protocol.
        CheckpointMismatch: another model file, or another session's terms.
    """
    try:
        content = _decode(data if data.startswith(_PLAIN) else zlib.decompress(data))
        arrays = {name: _restored(array) for name, array in content.memory.items()}
    except (zlib.error, msgspec.DecodeError, ValueError, TypeError):
        raise CheckpointUnknown("the checkpoint can't be read; expected a token as the service sent it") from None
    if (content.format, content.protocol) != (FORMAT, PROTOCOL):
        raise CheckpointUnknown(f"the checkpoint is of {content.protocol} format {content.format}; expected {PROTOCOL}")
    if content.model != bond.model:
        raise CheckpointMismatch("the checkpoint is of another model file; start the body anew")
    if content.terms != bond.terms:
        raise CheckpointMismatch(
            "the checkpoint is of a session with other terms; send the same session.start, with resume added"
        )
    answers = Answers.from_bytes(content.body.name, content.answers)
    return Opened(content.body, answers, Memory(arrays), content.fingerprint == bond.fingerprint)


def digest(parts: Mapping[str, object]) -> str:
    """A short digest of the terms of a session."""
    return hashlib.sha256(repr(sorted(parts.items())).encode()).hexdigest()[:16]


def _flattened(array: npt.NDArray[np.generic]) -> _Array:
    if array.dtype.byteorder not in "<|=" or not np.little_endian:
        array = array.astype(array.dtype.newbyteorder("<"))
    return _Array(array.dtype.str, array.shape, array.tobytes())


def _restored(array: _Array) -> npt.NDArray[np.generic]:
    dtype = np.dtype(array.dtype)
    return np.frombuffer(array.content, dtype).reshape(array.shape).astype(dtype.newbyteorder("="))
