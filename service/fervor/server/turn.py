"""The messages that came in one turn of the event loop, taken together.

Each stage is passed by all of them before the next: decoded, their joints read in blocks, planned by their sessions,
run by the engine. Nobody waits for company: the turn is taken as soon as the loop has handed over what it had.
"""

import asyncio
import logging
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple, Protocol

from fervor.engine.batcher import Batcher
from fervor.errors import EngineError
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.session.events import Outcome, Ticket
from fervor.session.poses import Read, read_poses
from fervor.session.start import Agreement

log = logging.getLogger(__name__)


class Taker(Protocol):
    """A conversation, seen from a turn."""

    __slots__ = ()

    @property
    def agreement(self) -> Agreement | None:
        """What its session agreed on; None before the start."""

    def decode_frames(self, message: str | bytes) -> LeanFrame | LeanFrames | None:
        """The message as lean frames; None where it is anything else."""

    def take(self, message: str | bytes, lean: LeanFrame | LeanFrames | None, poses: Sequence[Read]) -> None:
        """Do what the message asks; of lean frames, the poses were read already. Never raises."""

    def prompt(self, message: LeanFrame | LeanFrames, poses: Sequence[Read]) -> Sequence[Ticket]:
        """The tickets of frames about which nothing is unusual; none, having done nothing: `take` is to see them."""

    def answer(self, tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> None:
        """Answer a message whose tickets `prompt` gave; before anything else is taken. Never raises."""


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
        try:
            together = _read(came)
        except Exception:  # a fault of ours must cost nobody a message: then every session reads by itself
            log.exception("the frames of a turn could not be read together")
            together = [_Ready(taker, message, None, ()) for taker, message in came]
        while together:
            together = self._pass(together)

    def _pass(self, ready: Sequence["_Ready"]) -> list["_Ready"]:
        """Take messages and run what they bring; returns those behind a prompt frame of the same session."""
        prompt: dict[Taker, Sequence[Ticket]] = {}
        later = []
        for each in ready:
            taker, message, lean, poses = each
            if taker in prompt:
                later.append(each)
            elif lean and poses and (tickets := taker.prompt(lean, poses)):
                prompt[taker] = tickets
            else:
                taker.take(message, lean, poses)
        outcomes = iter(self._batcher.run([ticket for tickets in prompt.values() for ticket in tickets]))
        for taker, tickets in prompt.items():
            taker.answer(tickets, list(islice(outcomes, len(tickets))))
        return later


class _Ready(NamedTuple):
    taker: Taker
    message: str | bytes
    lean: LeanFrame | LeanFrames | None
    poses: Sequence[Read]


def _read(came: Sequence[tuple[Taker, str | bytes]]) -> list[_Ready]:
    """Decode messages, and read the poses of frames together.

    Frames behind a `session.start` in the same turn have no agreement yet; their session reads them.
    """
    decoded = [(taker, message, taker.decode_frames(message), taker.agreement) for taker, message in came]
    frames = [
        (agreement, frame)
        for _, _, lean, agreement in decoded
        if lean is not None and agreement is not None
        for frame in _frames_of(lean)
    ]
    poses = iter(read_poses(frames))
    return [
        _Ready(taker, message, lean, list(islice(poses, len(_frames_of(lean)))) if lean and agreement else ())
        for taker, message, lean, agreement in decoded
    ]


def _frames_of(lean: LeanFrame | LeanFrames) -> tuple[LeanFrame, ...]:
    return (lean,) if isinstance(lean, LeanFrame) else lean.frames
