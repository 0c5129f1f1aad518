"""The client's side of the protocol: what to send, and which frame an answer belongs to. No socket, no event loop.

Rules: `start` first, then frames · a frame is answered by one estimate or one error that names it · answers are matched
by (body, seq), in whatever order they come · a recoverable error concerns one message, the conversation goes on · a
fatal one ends it; what was answered before can still be read.

A conversation that resumes outlives its connections: `interrupted` says when to open the next one and `start` again.
Meanwhile it stays OPEN or ENDING, and frames are taken as ever; they leave once there is a connection.
"""

import logging
import time
from collections.abc import Callable, Mapping, Sequence

from fervor.errors import EngineError, FervorError, FrameError, InputError, MessageError, ProtocolError, Unreachable
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Checkpoint,
    Error,
    Estimate,
    Estimates,
    Ping,
    ServerMessage,
    SessionCalibrate,
    SessionCalibrated,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
)
from fervor_client.answers import Answers, Key
from fervor_client.failures import SUBPROTOCOL, told, unknown_type
from fervor_client.framing import Framer
from fervor_client.line import Line, Link
from fervor_client.poses import Pose
from fervor_client.retrying import Reconnect, Retries
from fervor_client.standing import Standing, State

logger = logging.getLogger("fervor_client")

News = FervorError | Reconnect
"""What a caller is told by callbacks: a recoverable error that nobody awaits, or how a reconnect goes."""


class Conversation(Standing):
    """One session as its client sees it.

    The caller's duties: send the payload of `start` on each new connection, then whatever `next_payload` gives, in that
    order; hand every message that comes to `receive`; call `interrupted` when a connection is gone or could not be had,
    and `lost` when there shall be none. Calls must not overlap.
    """

    def __init__(
        self,
        start: SessionStart,
        *,
        url: str,
        retries: Retries | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """`retries`: when to try again after a cut; None: the first one ends the conversation."""
        super().__init__(url)
        self.started: SessionStarted | None = None
        """The newest one: a resume brings another."""
        self._start = start
        self._codec = CODECS[SUBPROTOCOL]
        self._framer = Framer(now)
        self._answers = Answers(latest=start.delivery == "latest")
        self._line = Line(start, retries, now)

    @property
    def linked(self) -> bool:
        """Whether there is a connection on which the session goes on."""
        return self._line.link is Link.UP and not self.over

    @property
    def linking(self) -> bool:
        """Whether a new connection waits for its `session.started`."""
        return self._line.link is Link.STARTING and not self.over

    @property
    def reconnects(self) -> int:
        """Times that the session went on on another connection."""
        return self._line.reconnects

    @property
    def in_flight(self) -> int:
        """Frames sent and not yet answered."""
        return self._answers.in_flight

    # --- what to send -------------------------------------------------------------------------------------------------

    def start(self) -> str | bytes:
        """The payload that opens the conversation, or resumes it on a new connection."""
        if self.started is None:
            self.state, self._line.link = State.STARTING, Link.STARTING
            return self._codec.encode(self._start)
        return self._codec.encode(self._line.resume(self._start, self.started))

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
    ) -> int:
        """Take a pose as a frame to send; see `Session.send`. If `awaited`, the answer is kept for `take`.

        Returns:
            The frame's seq.

        Raises:
            FrameError: the pose, or one of the others, can't be sent; nothing happened.
            FervorError: the conversation is not open.
        """
        self.must_be_open()
        frame = self._framer.make(pose, self._joints, body=body, seq=seq, t=t, emotion=emotion, mask=mask)
        if self._answers.waits((body, frame.seq)):
            sentence = f"frame {frame.seq} of body {body!r} is under way; expected a seq that rises"
            raise FrameError(sentence, body=body, seq=frame.seq)
        frame = self._line.log.remind(frame)
        payload = self._codec.encode(frame)
        self._framer.count(frame)
        self._answers.expect((body, frame.seq), awaited=awaited)
        self._line.log.add_frame(frame, payload)
        self._line.post(payload)
        return frame.seq

    def reset_body(self, body: str) -> None:
        """Make the service forget what `body` did so far."""
        self.must_be_open()
        self._answers.count_reset()
        payload = self._codec.encode(BodyReset(body=body))
        if self._line.log.add_reset(body, payload):
            self._line.post(payload)

    def end_body(self, body: str) -> None:
        """Say that `body` is gone."""
        self.must_be_open()
        payload = self._codec.encode(BodyEnd(body=body))
        if self._line.log.add_end(body, payload):
            self._line.post(payload)

    def calibrate(self, request: SessionCalibrate) -> int:
        """Make the service take its alignment from the frames that follow; after a cut it is asked again.

        Returns:
            The number for `take_calibration`.
        """
        self.must_be_open()
        payload = self._codec.encode(request)
        number = self._line.log.add_calibrate(request, payload)
        self._line.post(payload)
        return number

    def ping(self) -> str | bytes:
        """A payload that says no more than that we are here; not in the queue of the others."""
        return self._codec.encode(Ping())

    def end(self) -> None:
        """End the conversation; answers under way still come."""
        self.must_be_open()
        self._line.post(self._codec.encode(SessionEnd()))
        self.state = State.ENDING

    def next_payload(self) -> str | bytes | None:
        """What to send next on this connection, if anything; wait `pause_s` first."""
        return self._line.next_payload()

    @property
    def pause_s(self) -> float:
        """Seconds to wait before the next payload, while a backlog leaves that the service would find too fast."""
        return self._line.pause_s

    # --- what comes ---------------------------------------------------------------------------------------------------

    def receive(self, payload: str | bytes) -> list[News]:
        """Take in a message.

        Returns:
            Recoverable errors that nobody awaits, and that the stream goes on after a cut.
        """
        message = None if self.over else self._read(payload)
        match message:
            case SessionStarted():
                return self._opened(message)
            case Estimate():
                self._answered(message)
            case Estimates():
                self._answered(*message.estimates)
            case Checkpoint():
                self._line.log.checkpoint(message)
            case Error():
                return self._refused(message)
            case SessionCalibrated():
                self._calibrated(message)
            case SessionEnded():
                self.ended(self._answers.totals if self.reconnects else message.totals)
        return []

    def interrupted(self, failure: FervorError) -> Reconnect | None:
        """The connection is gone, or there could be none; `failure` is why, unless the service told it.

        Returns:
            When to open another one and `start` again; None: never, the conversation is over.
        """
        reason = self._line.cut(failure)
        if self.over:
            return None
        if not self._line.resumes or self.state in (State.NEW, State.STARTING):
            self.lost(reason)
            return None
        waits = self.in_flight or self._line.log.calibrations.decided
        if self.state is State.ENDING and not waits:  # only the goodbye is missing
            self.ended(self._answers.totals)
            return None
        news = self._line.again(reason)
        if news is None:
            self.lost(self._line.surrender())
        return news

    # --- what came ----------------------------------------------------------------------------------------------------

    def next_estimate(self) -> Estimate | None:
        """The oldest unread estimate; None if there is none yet, or all is read and the conversation has ended.

        Raises:
            FervorError: the conversation failed, and all that came before is read.
        """
        estimate = self._answers.next()
        if estimate is None and self.failure is not None:
            raise self.failure
        return estimate

    def take(self, key: Key) -> Estimate | None:
        """The answer to an awaited frame; None if it has not come.

        Raises:
            FervorError: the service refused the frame, or the conversation is over.
        """
        answer = self._answers.take(key)
        if answer is None and self.over:
            raise self.failure or Unreachable(f"the session with {self.url} ended before frame {key[1]} was answered")
        return answer

    def take_calibration(self, number: int) -> SessionCalibrated | None:
        """What a calibration found, once; None while it is under way.

        Raises:
            FervorError: it failed, another one took its place, or the conversation is over.
        """
        found = self._line.log.calibrations.take(number)
        if found is None and self.over:
            self.must_be_open()
        return found

    def give_up(self, key: Key) -> None:
        """Nobody awaits this frame any more."""
        self._answers.give_up(key)

    def _read(self, payload: str | bytes) -> ServerMessage | None:
        """The message; None if a newer service says what this client does not know, or nothing that makes sense."""
        try:
            return self._codec.decode_server(payload)
        except MessageError as error:
            if (kind := unknown_type(payload)) is not None:
                logger.debug("skipped a message of the unknown type %r", kind)
            else:
                self.lost(ProtocolError(f"the service at {self.url} sent what this client can't read: {error.message}"))
        return None

    @property
    def _joints(self) -> tuple[str, ...]:
        assert self.started is not None, "only an open conversation sends frames"
        return self.started.joints

    def _opened(self, message: SessionStarted) -> list[News]:
        again, self.started = self.started is not None, message
        self._line.log.idle_s = message.limits.body_idle_s
        if not again:
            self.state, self._line.link = State.OPEN, Link.UP
            return []
        news, echoes = self._line.resumed(message)
        self._answers.expect_again(echoes)
        if self.state is State.ENDING:
            self._line.post(self._codec.encode(SessionEnd()))
        return [news]

    def _answered(self, *estimates: Estimate) -> None:
        for estimate in estimates:
            key = (estimate.body, estimate.seq)
            if self._answers.waits(key) and self._line.log.begins_anew(estimate.body) and "reset" not in estimate.flags:
                estimate = estimate.model_copy(update={"flags": ("reset", *estimate.flags)})  # noqa: PLW2901
            settled = self._answers.settle(estimate)
            if settled:
                self._line.log.answered(settled, estimate.flags)
                self._line.progress()

    def _calibrated(self, message: SessionCalibrated) -> None:
        """From here on a resume must ask for the new alignment, under the name that the service goes on using."""
        asked = self._start.skeleton
        name = asked if isinstance(asked, str) else asked.name
        self._start = self._start.model_copy(update={"skeleton": message.skeleton.model_copy(update={"name": name})})
        self._line.log.calibrated(message)

    def _refused(self, message: Error) -> list[News]:
        error = told(message)
        if message.fatal:
            self._line.fault, self._line.link = error, Link.DOWN
            if not self._line.resumes or self.started is None:
                self.lost(error)
            return []
        if message.body is not None and message.seq is not None:
            key = (message.body, message.seq)
            awaited = self._answers.refuse(key, error)
            if awaited is not None:
                self._line.log.refused(key, forget=not isinstance(error, EngineError))
                self._line.progress()
            return [error] if awaited is False else []
        if type(error) is InputError and self._line.log.calibration_failed(message.body, error):
            return []
        return [error]
