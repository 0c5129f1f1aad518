"""One tracked person: from a frame to the work it brings, from that work's outcome to an estimate.

A body holds scalars only; its recurrent tensors and poses live in the engine under its slot.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import msgspec
import numpy as np

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor.levels import LevelState, next_level
from fervor.metadata import ModelMetadata
from fervor.protocol.lean_estimate import LeanEstimate
from fervor.protocol.messages import Clock, Flag, Memory, Status
from fervor.session.answers import Answers
from fervor.session.checkpoint import Bookkeeping
from fervor.session.events import Outcome, Pose, Source, Step, Ticket
from fervor.session.label import NO_LABEL, Label, make_label
from fervor.session.lanes import lane_plan, window_steps
from fervor.session.spread import Spread
from fervor.session.timeline import SAME_INSTANT_S, Advance, Instant, Timeline, advance, count_frame
from fervor.skeletons.rig import UPPER_BODY

WARM_UP_S = 1.0
"""Seconds after a reset in which an estimate rests on too little motion."""

ENOUGH_JOINTS = 0.6
"""Share of the upper-body joints its sensor can see that a frame must show."""


@dataclass(frozen=True, slots=True)
class Terms:
    """What a session agreed on, for all its bodies."""

    metadata: ModelMetadata
    source: Source
    clock: Clock = "time"
    memory: Memory = "staggered"
    emotion_ttl_s: float | None = None
    by_emotion: bool = False
    checkpoint_s: float | None = None


class Body:
    """The bookkeeping of one body, driven by its frames alone."""

    __slots__ = (
        "_answers",
        "_emotion",
        "_enough",
        "_label",
        "_lanes",
        "_level",
        "_next_checkpoint",
        "_pending",
        "_phase",
        "_put_off",
        "_rule",
        "_terms",
        "_timeline",
        "_window",
        "in_flight",
        "last",
        "name",
        "newest_seq",
        "slot",
    )

    def __init__(self, name: str, slot: int, terms: Terms, label: Label = NO_LABEL) -> None:
        self.name = name
        self.slot = slot
        self.in_flight = 0
        self.newest_seq = -1
        self.last: float | None = None
        """Time of its newest frame, with a pose or without, seconds on the client's clock."""
        self._terms = terms
        self._rule = terms.metadata.levels
        self._lanes = lane_plan(terms.metadata.rate_hz)
        self._window = window_steps(terms.memory, terms.metadata.rate_hz)
        self._label = label
        self._timeline: Timeline | None = None
        self._level: LevelState | None = None
        self._emotion = UNKNOWN
        self._pending: tuple[Flag, ...] = ()
        self._next_checkpoint = -math.inf  # seconds
        self._phase = 0.0  # seconds after the beginning of a span
        self._put_off = False
        self._answers = Answers(name)
        self._enough = enough_joints(terms)

    @property
    def begun(self) -> bool:
        """Whether it has an answer: while the engine has run nothing for it, its slot may hold another's pose."""
        return self._answers.any

    @property
    def newest(self) -> LeanEstimate | None:
        """Its newest estimate; None before the first."""
        return self._answers.newest

    def reset(self, flag: Flag = "reset") -> None:
        """Forget poses, states and level; the next frame is a first one and says so."""
        self._timeline = None
        self._pending = (flag,)

    def adopt(self, terms: Terms) -> None:
        """Go on under new terms, from a reset."""
        self._terms = terms
        self._enough = enough_joints(terms)
        self.reset()
        self._next_checkpoint = -math.inf  # those before are of terms that no longer hold

    def answered(self, seq: int) -> LeanEstimate | None:
        """The estimate a duplicate of frame `seq` gets again; None if it is under way or forgotten."""
        return _again(self._answers.find(seq))

    def plan(
        self,
        seq: int,
        time: float,
        pose: Pose,
        *,
        emotion: str | Mapping[str, float] | None = None,
        group: int | None = None,
        keep: bool = True,
        spread: Spread | None = None,
    ) -> Ticket:
        """The work that frame `seq` at `time` (seconds) brings; a checkpoint with it where one is due, if `keep`.

        Where others are due too, `spread` may put it off to a later frame.

        Raises:
            InputError: an emotion that is not known; the frame then left no trace.
        """
        terms, label = self._terms, self._label
        if emotion is not None:
            label = make_label(emotion, time, terms.emotion_ttl_s)
        late, lost, fresh = seq <= self.newest_seq, pose.lost, self._timeline is None
        moved = self._move(time, late=late, lost=lost)
        flags: tuple[Flag, ...] = moved.flags
        if not late:
            self.newest_seq = seq
        if not flags or "late" not in flags:
            self.last, self._label = time, label
        if moved.fresh and self._pending:
            flags, self._pending = (*self._pending, *flags), ()
        if lost:
            flags = (*flags, "lost")
        if self._answers.expect(seq, new=not late):
            flags = ("duplicate",)
        line = self._timeline = moved.timeline
        self.in_flight += 1
        return Ticket(
            self.slot,
            self.name,
            seq,
            time,
            terms.source,
            None if lost or late or (flags and "late" in flags) else pose,
            fresh or moved.fresh,
            tuple([self._step(instant) for instant in moved.instants]),
            flags,
            line.origin if line is not None else time,
            group,
            True,  # noqa: FBT003  # by place: a keyword costs as much as the field
            self._keep() if keep and self._is_due(time, spread) else None,
        )

    def snapshot(self, time: float, group: int | None = None) -> Ticket:
        """A ticket that brings no work and no estimate, but a checkpoint of the body as it is after all others."""
        return Ticket(
            slot=self.slot,
            body=self.name,
            seq=self.newest_seq,
            time=time,
            source=self._terms.source,
            pose=None,
            fresh=False,
            steps=(),
            flags=(),
            since=time,
            group=group,
            answer=False,
            checkpoint=self._keep(),
        )

    def bookkeeping(self, ticket: Ticket) -> Bookkeeping:
        """What the body held right after `ticket` was concluded; to be called then.

        Raises:
            ValueError: no checkpoint was due with this ticket.
        """
        if ticket.checkpoint is None:
            raise ValueError(f"no checkpoint was due with frame {ticket.seq}")
        level = None if self._level is None else (self._level.level, self._level.since)
        return msgspec.structs.replace(ticket.checkpoint, level=level, emotion=self._emotion)

    def answers(self) -> tuple[bytes, ...]:
        """What it was answered so far, for a checkpoint."""
        return self._answers.to_bytes()

    @classmethod
    def restore(cls, kept: Bookkeeping, answers: Answers, slot: int, terms: Terms) -> "Body":
        """The body as it was, in another slot."""
        vector, name, until = kept.label
        body = cls(kept.name, slot, terms, Label(np.array(vector, np.float32), name, until))
        body.newest_seq = kept.newest_seq
        body._timeline = None if kept.timeline is None else Timeline(*kept.timeline)
        body.last = kept.last
        body._pending = kept.pending
        body._level = None if kept.level is None else LevelState(*kept.level)
        body._emotion = kept.emotion
        body._answers = answers
        return body

    def _keep(self) -> Bookkeeping:
        """What was planned so far; level and emotion follow when the outcome is there."""
        line, label = self._timeline, self._label
        return Bookkeeping(
            name=self.name,
            newest_seq=self.newest_seq,
            timeline=None if line is None else (line.origin, line.last, line.steps),
            last=self.last,
            label=(tuple(label.vector.tolist()), label.name, label.until),
            pending=self._pending,
            level=None,
            emotion=UNKNOWN,
        )

    def _is_due(self, time: float, spread: Spread | None) -> bool:
        """Whether a checkpoint goes with the frame at `time`: one in every span of `checkpoint_s`."""
        span = self._terms.checkpoint_s
        if span is None or self._next_checkpoint - span <= time < self._next_checkpoint:
            return False
        if spread is not None and not spread.take():
            self._put_off = True
            return False
        if self._put_off:
            self._phase, self._put_off = time % span, False
        spans = math.floor((time - self._phase + SAME_INSTANT_S) / span)
        self._next_checkpoint = (spans + 1) * span + self._phase
        return True

    def conclude(self, ticket: Ticket, outcome: Outcome) -> LeanEstimate:
        """The estimate for a ticket, in the order in which tickets were planned."""
        self.in_flight -= 1
        flags, steps, intensity = ticket.flags, ticket.steps, outcome.intensity
        if flags == ("duplicate",) and (answer := _again(self._answers.given(ticket.seq))):
            return answer
        if ticket.fresh:
            self._level = None
        if steps:
            self._emotion = steps[-1].label.name
            if intensity is not None:
                self._level = self._next_level(intensity, ticket.time)
        estimate = LeanEstimate(
            self.name,
            ticket.seq,
            ticket.time,
            intensity,
            None if self._level is None or intensity is None else self._level.level,
            self._emotion,
            self._status(ticket, outcome),
            (*flags, "jump") if outcome.jumped else flags,
            self._by_emotion(outcome) if self._terms.by_emotion else None,
        )
        self._answers.give(estimate)
        return estimate

    def fail(self, ticket: Ticket) -> None:
        """There is no outcome for a ticket: the body starts anew."""
        self.in_flight -= 1
        self._answers.fail(ticket.seq)
        self.reset()

    def _move(self, time: float, *, late: bool, lost: bool) -> Advance:
        """Where the frame stands in time; a late or empty one moves nothing."""
        if late:
            return Advance(self._timeline, flags=("late",))
        if lost:
            return Advance(self._timeline)
        if self._terms.clock == "frames":
            return count_frame(self._timeline, time)
        return advance(self._timeline, time, rate_hz=self._terms.metadata.rate_hz)

    def _step(self, instant: Instant) -> Step:
        return Step(
            instant.fraction,
            instant.held,
            self._lanes.row(self._terms.memory, instant.index),
            self._window,
            self._label if self._label.until is None else self._label.at(instant.time),
        )

    def _next_level(self, intensity: float, time: float) -> LevelState:
        rule = self._rule
        return next_level(
            self._level,
            intensity=intensity,
            time=time,
            threshold=rule.threshold[self._emotion],
            hysteresis=rule.hysteresis,
            dwell=rule.dwell_s,
        )

    def _status(self, ticket: Ticket, outcome: Outcome) -> Status:
        if outcome.seen < self._enough or (ticket.flags and "lost" in ticket.flags):
            return "insufficient"
        return "warming_up" if ticket.time - ticket.since < WARM_UP_S else "ok"

    def _by_emotion(self, outcome: Outcome) -> dict[str, float] | None:
        if outcome.intensity is None:
            return None
        return dict(zip(EMOTIONS, outcome.by_emotion.tolist(), strict=True))


def _again(estimate: LeanEstimate | None) -> LeanEstimate | None:
    return None if estimate is None else msgspec.structs.replace(estimate, flags=(*estimate.flags, "duplicate"))


def enough_joints(terms: Terms) -> float:
    """Upper-body joints that a frame must show."""
    seen = terms.source.skeleton.sees
    return ENOUGH_JOINTS * sum(seen[joint] for joint in UPPER_BODY)
