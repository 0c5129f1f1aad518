"""The messages that came in one turn of the event loop, taken together.

Each stage is passed by all of them before the next: decoded, their joints read in blocks, planned by their sessions,
run by the engine. Nobody waits for company: the turn is taken as soon as the loop has handed over what it had.
"""

import asyncio
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from fervor.engine.batcher import Batcher
from fervor.protocol.raw_frame import RawFrame, RawFrames
from fervor.session.poses import Read, read_poses
from fervor.session.start import Agreement


class Taker(Protocol):
    """A conversation, seen from a turn."""

    @property
    def agreement(self) -> Agreement | None:
        """What its session agreed on; None before the start."""

    def decode_raw(self, message: str | bytes) -> RawFrame | RawFrames | None:
        """The message as raw frames; None where it is anything else."""

    def take(self, message: str | bytes, raw: RawFrame | RawFrames | None, poses: Sequence[Read]) -> None:
        """Do what the message asks; of raw frames, the poses were read already. Never raises."""


class Turn:
    """What came, in order."""

    def __init__(self, batcher: Batcher) -> None:
        self._batcher = batcher
        self._came: list[tuple[Taker, str | bytes]] = []

    def put(self, taker: Taker, message: str | bytes) -> None:
        """Take this message with the others of this turn, after all that came before it."""
        if not self._came:
            asyncio.get_running_loop().call_soon(self._take)
        self._came.append((taker, message))

    @property
    def depth(self) -> int:
        """Messages that wait for the turn's end."""
        return len(self._came)

    def _take(self) -> None:
        came, self._came = self._came, []
        decoded = [_decode(taker, message) for taker, message in came]
        poses = read_poses([(each.agreement, frame) for each in decoded for frame in each.frames if each.agreement])
        at = 0
        for each in decoded:
            stop = at + (len(each.frames) if each.agreement else 0)
            each.taker.take(each.message, each.raw, poses[at:stop])
            at = stop
        self._batcher.run()


class _Decoded(NamedTuple):
    taker: Taker
    message: str | bytes
    raw: RawFrame | RawFrames | None
    frames: tuple[RawFrame, ...]
    agreement: Agreement | None
    """As it was before the turn: frames behind a `session.start` in the same turn are read by their session."""


def _decode(taker: Taker, message: str | bytes) -> _Decoded:
    raw = taker.decode_raw(message)
    frames = () if raw is None else (raw,) if isinstance(raw, RawFrame) else raw.frames
    return _Decoded(taker, message, raw, frames, taker.agreement)
