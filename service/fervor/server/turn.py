"""The messages that came in one turn of the event loop, taken together.

Each stage is passed by all of them before the next: decoded, their joints read in blocks, planned by their sessions,
run by the engine. Nobody waits for company: the turn is taken as soon as the loop has handed over what it had.
"""

import asyncio
import logging
from collections.abc import Sequence
from typing import Protocol

from fervor.engine.batcher import MOST_TICKETS, Batcher
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


_Ready = tuple[Taker, str | bytes, LeanFrame | LeanFrames | None, Sequence[Read]]
"""Who a message came to, the message, its lean frames if it has any, and their poses."""


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
        for first in range(0, len(came), MOST_TICKETS):  # so that the first of many need not wait for the last
            self._take_together(came[first : first + MOST_TICKETS])

    def _take_together(self, came: Sequence[tuple[Taker, str | bytes]]) -> None:
        try:
            ready = _read(came)
        except Exception:  # a fault of ours must cost nobody a message: then every session reads by itself
            log.exception("the frames of a turn could not be read together")
            ready = [(taker, message, None, ()) for taker, message in came]
        while ready:
            ready = self._pass(ready)

    def _pass(self, ready: Sequence[_Ready]) -> list[_Ready]:
        """Take messages and run what they bring; returns those behind a prompt frame of the same session."""
        prompt: dict[Taker, Sequence[Ticket]] = {}
        work: list[Ticket] = []
        later = []
        for each in ready:
            taker, message, lean, poses = each
            if taker in prompt:
                later.append(each)
            elif lean and poses and (tickets := taker.prompt(lean, poses)):
                prompt[taker] = tickets
                work += tickets
            else:
                taker.take(message, lean, poses)
        outcomes, at = self._batcher.run(work), 0
        for taker, tickets in prompt.items():
            end = at + len(tickets)
            taker.answer(tickets, outcomes[at:end])
            at = end
        return later


def _read(came: Sequence[tuple[Taker, str | bytes]]) -> list[_Ready]:
    """Decode messages, and read the poses of frames together.

    Frames behind a `session.start` in the same turn have no agreement yet; their session reads them.
    """
    frames: list[tuple[Agreement, LeanFrame]] = []
    decoded = []
    for taker, message in came:
        lean, agreement, begin = taker.decode_frames(message), taker.agreement, len(frames)
        if agreement is not None and lean is not None:
            if isinstance(lean, LeanFrame):
                frames.append((agreement, lean))
            else:
                frames += [(agreement, frame) for frame in lean.frames]
        decoded.append((taker, message, lean, begin, len(frames)))
    poses = read_poses(frames)
    return [(taker, message, lean, poses[begin:end]) for taker, message, lean, begin, end in decoded]
