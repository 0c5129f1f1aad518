"""The client's side of the protocol: what to send, and which frame an answer belongs to. No socket, no event loop.

Rules: `start` first, then frames · a frame is answered by one estimate or one error that names it · answers are matched
by (body, seq), in whatever order they come · a recoverable error concerns one message, the conversation goes on · a
fatal one ends it, and so does the loss of the connection; what was answered before can still be read.

    NEW ──start──▶ STARTING ──session.started──▶ OPEN ──end──▶ ENDING ──session.ended──▶ CLOSED
                       └───────────── fatal error, connection lost, from any state ─────────▲
"""

import logging
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from enum import Enum, auto

from pydantic import ValidationError

from fervor.errors import FervorError, FrameError, InputError, MessageError, ProtocolError
from fervor.protocol.codec import CODECS, one_sentence
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    ClientMessage,
    Error,
    Estimate,
    Estimates,
    Frame,
    Ping,
    SessionCalibrate,
    SessionCalibrated,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor_client.failures import SUBPROTOCOL, Unreachable, told
from fervor_client.options import wire_emotion
from fervor_client.poses import Pose, to_joints

logger = logging.getLogger("fervor_client")

UNREAD = 65_536
"""Estimates kept for a caller who does not read them (half an hour of one body); then the oldest go."""

Key = tuple[str, int]
"""A frame: its body and seq."""


class State(Enum):
    """Where a conversation stands."""

    NEW = auto()
    STARTING = auto()
    OPEN = auto()
    ENDING = auto()
    CLOSED = auto()


class Conversation:
    """One session as its client sees it.

    The caller's duties: send every payload in the order in which it was made; hand every message that comes to
    `receive`; call `lost` when the connection is gone. Calls must not overlap.
    """

    def __init__(self, start: SessionStart, *, url: str, now: Callable[[], float] = time.monotonic) -> None:
        self.state = State.NEW
        self.url = url
        self.failure: FervorError | None = None
        """Why the conversation ended, unless both sides wanted it to."""
        self.started: SessionStarted | None = None
        self.totals: Totals | None = None
        """What the service counted, once it has said so."""
        self._start = start
        self._now = now
        self._codec = CODECS[SUBPROTOCOL]
        self._next_seq: dict[str, int] = {}
        self._width = 4  # numbers a joint had in the newest pose
        self._unanswered: dict[Key, None] = {}  # in the order sent
        self._awaited: dict[Key, Estimate | FervorError | None] = {}
        self._inbox: deque[Estimate] = deque()
        self._overflowed = False
        self._calibrating = False
        self._calibration: SessionCalibrated | FervorError | None = None

    @property
    def in_flight(self) -> int:
        """Frames sent and not yet answered."""
        return len(self._unanswered)

    @property
    def over(self) -> bool:
        """Whether nothing more will come."""
        return self.state is State.CLOSED

    # --- what to send -------------------------------------------------------------------------------------------------

    def start(self) -> str | bytes:
        """The payload that opens the conversation."""
        self.state = State.STARTING
        return self._codec.encode(self._start)

    def frame(
        self,
        pose: Pose,
        *,
        body: str = "0",
        seq: int | None = None,
        t: float | None = None,
        emotion: str | Mapping[str, float] | None = None,
        mask: Sequence[bool] | None = None,
        awaited: bool = False,
    ) -> tuple[int, str | bytes]:
        """A pose as a frame.

        Args:
            pose: see `Session.send`.
            body: whose it is.
            seq: its number; one more than the body's last if None.
            t: seconds on the caller's clock; the monotonic clock if None.
            emotion: a new label or a probability per emotion; the old one holds if None.
            mask: false where a joint is untracked.
            awaited: the answer is kept for `take` instead of the inbox.

        Returns:
            The frame's seq, and the payload.

        Raises:
            FrameError: the pose, or one of the others, can't be sent; nothing happened.
            FervorError: the conversation is not open.
        """
        self.must_be_open()
        seq = self._next_seq.get(body, 0) if seq is None else seq
        try:
            joints = to_joints(pose, self._joints, width=self._width)
            frame = Frame(
                body=body,
                seq=seq,
                t=self._now() if t is None else float(t),
                **joints,
                mask=None if mask is None else tuple(bool(seen) for seen in mask),
                emotion=wire_emotion(emotion),
            )
        except ValidationError as error:
            raise FrameError(one_sentence(error), body=body, seq=seq) from None
        except FrameError as error:
            raise FrameError(f"frame {seq} of body {body!r}: {error.message}", body=body, seq=seq) from None
        self._width = 4 if "q" in joints else 3
        self._next_seq[body] = max(seq + 1, self._next_seq.get(body, 0))
        self._unanswered[body, seq] = None
        if awaited:
            self._awaited[body, seq] = None
        return seq, self._codec.encode(frame)

    def reset_body(self, body: str) -> str | bytes:
        """The payload that makes the service forget what `body` did so far."""
        return self._encode(BodyReset(body=body))

    def end_body(self, body: str) -> str | bytes:
        """The payload that says `body` is gone."""
        return self._encode(BodyEnd(body=body))

    def calibrate(self, request: SessionCalibrate) -> str | bytes:
        """The payload that makes the service take its alignment from the frames that follow."""
        payload = self._encode(request)
        self._calibrating, self._calibration = True, None
        return payload

    def ping(self) -> str | bytes:
        """A payload that says no more than that we are here."""
        return self._codec.encode(Ping())

    def end(self) -> str | bytes:
        """The payload that ends the conversation; answers under way still come."""
        payload = self._encode(SessionEnd())
        self.state = State.ENDING
        return payload

    # --- what comes ---------------------------------------------------------------------------------------------------

    def receive(self, payload: str | bytes) -> list[FervorError]:
        """Take in a message.

        Returns:
            Recoverable errors that nobody awaits.
        """
        if self.over:
            return []
        try:
            message = self._codec.decode_server(payload)
        except MessageError as error:
            self.lost(ProtocolError(f"the service at {self.url} sent what this client can't read: {error.message}"))
            return []
        match message:
            case SessionStarted():
                self.started, self.state = message, State.OPEN
            case Estimate():
                self._answered(message)
            case Estimates():
                for estimate in message.estimates:
                    self._answered(estimate)
            case Error():
                return self._refused(message)
            case SessionCalibrated():
                self._calibrating, self._calibration = False, message
            case SessionEnded():
                self.totals, self.state = message.totals, State.CLOSED
        return []

    def lost(self, failure: FervorError | None) -> None:
        """The conversation is over; `failure` says why, None that it was meant to be."""
        if not self.over:
            self.state, self.failure = State.CLOSED, failure

    # --- what came ----------------------------------------------------------------------------------------------------

    def next_estimate(self) -> Estimate | None:
        """The oldest unread estimate; None if there is none yet, or all is read and the conversation has ended.

        Raises:
            FervorError: the conversation failed, and all that came before is read.
        """
        if self._inbox:
            return self._inbox.popleft()
        if self.failure is not None:
            raise self.failure
        return None

    def take(self, key: Key) -> Estimate | None:
        """The answer to an awaited frame; None if it has not come.

        Raises:
            FervorError: the service refused the frame, or the conversation is over.
        """
        answer = self._awaited.get(key)
        if isinstance(answer, FervorError):
            raise answer
        if answer is None and self.over:
            raise self.failure or Unreachable(f"the session with {self.url} ended before frame {key[1]} was answered")
        return answer

    def take_calibration(self) -> SessionCalibrated | None:
        """What the calibration found; None while it is under way.

        Raises:
            FervorError: it failed, or the conversation is over.
        """
        found = self._calibration
        if isinstance(found, FervorError):
            raise found
        if found is None and self.over:
            self.must_be_open()
        return found

    def give_up(self, key: Key) -> None:
        """Nobody awaits this frame any more."""
        self._awaited.pop(key, None)

    def must_be_open(self) -> None:
        """Raise why nothing can be sent, unless something can."""
        if self.state is State.OPEN:
            return
        if self.failure is not None:
            raise self.failure
        what = "has not started" if self.state in (State.NEW, State.STARTING) else "has ended; connect again"
        raise Unreachable(f"the session with {self.url} {what}")

    @property
    def _joints(self) -> tuple[str, ...]:
        assert self.started is not None, "only an open conversation sends frames"
        return self.started.joints

    def _encode(self, message: ClientMessage) -> str | bytes:
        self.must_be_open()
        return self._codec.encode(message)

    def _answered(self, estimate: Estimate) -> None:
        key = (estimate.body, estimate.seq)
        for frame in self._settled(key):
            self._unanswered.pop(frame, None)
            if frame in self._awaited:
                self._awaited[frame] = estimate
        if key not in self._awaited:
            self._keep(estimate)

    def _settled(self, key: Key) -> list[Key]:
        """The frames that an estimate answers: its own, and those that delivery `latest` skipped for it."""
        if self._start.delivery == "every":
            return [key]
        body, seq = key
        return [frame for frame in self._unanswered if frame[0] == body and frame[1] <= seq]

    def _keep(self, estimate: Estimate) -> None:
        self._inbox.append(estimate)
        if len(self._inbox) <= UNREAD:
            return
        self._inbox.popleft()
        if not self._overflowed:
            logger.warning("%d estimates are unread; from now on the oldest are dropped", UNREAD)
        self._overflowed = True

    def _refused(self, message: Error) -> list[FervorError]:
        error = told(message)
        if message.fatal:
            self.lost(error)
            return []
        key = None if message.body is None or message.seq is None else (message.body, message.seq)
        if key is not None:
            self._unanswered.pop(key, None)
        if key is not None and key in self._awaited:
            self._awaited[key] = error
        elif self._calibrating and type(error) is InputError and key is None:
            self._calibrating, self._calibration = False, error
        else:
            return [error]
        return []
