"""A checkpoint: all that is needed to go on with a body as if nothing had happened, as bytes.

Bookkeeping as JSON (Python's floats survive it to the bit), then arrays raw, little-endian: the engine's, and the
answers to the newest frames. All of it deflated, which halves it. Bound to the model file, the protocol and the terms
of the session: a state makes no sense under others. Who may make and read one is not decided here; see
`fervor.session.sealing`.
"""

import hashlib
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from fervor.errors import CheckpointMismatch, CheckpointUnknown
from fervor.levels import Level
from fervor.protocol.messages import PROTOCOL, Flag
from fervor.session.answers import Answers, Arrays

FORMAT = 2
"""Version of these bytes."""

_ANSWER = "answer."
"""Prefix of the names of arrays that are a body's own, not the engine's."""


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """What the engine holds of one body: arrays by name, copied."""

    arrays: Arrays


class Bookkeeping(BaseModel):
    """What a body holds of itself, right after its frame `newest_seq`."""

    model_config = ConfigDict(frozen=True)

    name: str
    newest_seq: int
    timeline: tuple[float, float, int] | None  # origin s, last s, steps
    last: float | None  # seconds
    label: tuple[tuple[float, ...], str, float | None]  # vector [emotion], name, until s
    pending: tuple[Flag, ...]
    level: tuple[Level, float] | None  # level, since s
    emotion: str


class _Head(BaseModel):
    format: int
    protocol: str
    model: str
    fingerprint: str
    terms: str
    body: Bookkeeping
    arrays: tuple[tuple[str, str, tuple[int, ...]], ...]  # name, dtype, shape


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


def pack(bond: Bond, body: Bookkeeping, answers: Arrays, memory: Memory) -> bytes:
    """The bytes of a checkpoint."""
    own = {f"{_ANSWER}{name}": array for name, array in answers.items()}
    arrays = {name: np.asarray(array, order="C") for name, array in (own | memory.arrays).items()}
    head = _Head(
        format=FORMAT,
        protocol=PROTOCOL,
        model=bond.model,
        fingerprint=bond.fingerprint,
        terms=bond.terms,
        body=body,
        arrays=tuple((name, array.dtype.newbyteorder("<").str, array.shape) for name, array in arrays.items()),
    ).model_dump_json()
    parts = [array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes() for array in arrays.values()]
    encoded = head.encode()
    return zlib.compress(b"".join([len(encoded).to_bytes(4, "little"), encoded, *parts]), level=1)


def unpack(data: bytes, bond: Bond) -> Opened:
    """Read the bytes of a checkpoint for a session bound to `bond`.

    Raises:
        CheckpointUnknown: these are no bytes of a checkpoint, or of another format or protocol.
        CheckpointMismatch: another model file, or another session's terms.
    """
    try:
        inflated = zlib.decompress(data)
        size = int.from_bytes(inflated[:4], "little")
        head = _Head.model_validate_json(inflated[4 : 4 + size])
        arrays = _arrays(inflated[4 + size :], head.arrays)
    except (zlib.error, ValidationError, ValueError, TypeError):
        raise CheckpointUnknown("the checkpoint can't be read; expected a token as the service sent it") from None
    if (head.format, head.protocol) != (FORMAT, PROTOCOL):
        raise CheckpointUnknown(f"the checkpoint is of {head.protocol} format {head.format}; expected {PROTOCOL}")
    if head.model != bond.model:
        raise CheckpointMismatch("the checkpoint is of another model file; start the body anew")
    if head.terms != bond.terms:
        raise CheckpointMismatch(
            "the checkpoint is of a session with other terms; send the same session.start, with resume added"
        )
    own = {name.removeprefix(_ANSWER): array for name, array in arrays.items() if name.startswith(_ANSWER)}
    memory = Memory({name: array for name, array in arrays.items() if not name.startswith(_ANSWER)})
    return Opened(head.body, Answers.from_arrays(head.body.name, own), memory, head.fingerprint == bond.fingerprint)


def digest(parts: Mapping[str, object]) -> str:
    """A short digest of the terms of a session."""
    return hashlib.sha256(repr(sorted(parts.items())).encode()).hexdigest()[:16]


def _arrays(data: bytes, table: tuple[tuple[str, str, tuple[int, ...]], ...]) -> Arrays:
    arrays: Arrays = {}
    start = 0
    for name, dtype, shape in table:
        count = int(np.prod(shape, dtype=np.int64))
        end = start + count * np.dtype(dtype).itemsize
        array = np.frombuffer(data[start:end], dtype).reshape(shape)
        arrays[name] = array.astype(array.dtype.newbyteorder("="))
        start = end
    if start != len(data):
        raise ValueError("bytes are left over")
    return arrays
