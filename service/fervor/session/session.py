"""One conversation: messages in, events out. The edge carries them out in order and brings outcomes back.

The caller's duties: hand every message to `receive` (or, if it could not be decoded, its error to `refuse`); submit
every `Ticket` to the engine in order and hand each outcome to `conclude`; call `lost` once when the connection is gone.
"""

import math
from collections.abc import Iterable, Sequence

from fervor.emotions import emotion_vector
from fervor.errors import CloseCode, EngineError, FervorError, FrameError, InputError, ProtocolError
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Checkpoint,
    Error,
    Frame,
    Frames,
    Ping,
    Pong,
    SessionCalibrate,
    SessionCalibrated,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor.protocol.raw_frame import RawFrame, RawFrames
from fervor.session.body import Body
from fervor.session.calibrator import Calibrator
from fervor.session.checkpoint import Bond, pack
from fervor.session.events import Close, Event, Outcome, Pose, Reply, Said, Source, Ticket
from fervor.session.groups import Groups
from fervor.session.host import Host
from fervor.session.poses import Read
from fervor.session.resuming import resume
from fervor.session.roster import Roster
from fervor.session.start import Agreement, agree
from fervor.session.state import SessionState, transition

AnyFrame = Frame | RawFrame

Rare = SessionStart | BodyReset | BodyEnd | SessionCalibrate | Ping | SessionEnd
"""What comes now and then."""

Incoming = AnyFrame | Frames | RawFrames | Rare
"""A client's message, with frames in either form."""


class Session:
    """One client's conversation and its bodies."""

    def __init__(self, session_id: str, host: Host) -> None:
        self.session_id = session_id
        self.state = SessionState.NEW
        self._host = host
        self._agreement: Agreement | None = None
        self._bond: Bond | None = None  # of checkpoints, to that agreement; once one is needed
        self._roster = Roster(host.claim, most=host.limits.max_bodies, idle_s=host.limits.body_idle_s)
        self._tickets: dict[Ticket, tuple[Body, int]] = {}  # under way → its body, its place in the group
        self._outcomes: dict[Ticket, Outcome | EngineError] = {}  # that wait for those of earlier tickets
        self._groups = Groups()
        self._calibrator = Calibrator()
        self._calibrated: dict[Ticket, int] = {}  # last frame of a calibration → the group that tells of it
        self._totals = Totals().model_dump()

    @property
    def totals(self) -> Totals:
        """What the session came to so far."""
        return Totals(**self._totals)

    @property
    def bodies(self) -> Iterable[Body]:
        """The bodies that it follows, in the order in which they came."""
        return self._roster

    @property
    def source(self) -> Source | None:
        """What kind of joints it gets; None before its start."""
        return None if self._agreement is None else self._agreement.terms.source

    @property
    def agreement(self) -> Agreement | None:
        """What was agreed on; None before the start."""
        return self._agreement

    def receive(self, message: Incoming, poses: Sequence[Read] = ()) -> list[Event]:
        """What a message brings. Errors come back as replies; a fatal one is followed by `Close`.

        Args:
            message: as it came.
            poses: of its frames, where they were read already.
        """
        try:
            self.state = transition(self.state, message.type)
            if isinstance(message, RawFrame | Frame):
                return self._frame(message, poses[0] if poses else None)
            if isinstance(message, RawFrames | Frames):
                return self._frames(message.frames, poses)
            return self._dispatch(message)
        except FervorError as error:
            return self.refuse(error)

    def prompt(self, frame: RawFrame, read: Read) -> Ticket | None:
        """The ticket of a frame about which nothing is unusual, as nearly all are; None: `receive` is to take it.

        For a caller that runs the ticket, and hands its outcome to `answer`, before anything else of this session:
        then nothing need be kept of it meanwhile. What comes of it is the same.

        Args:
            frame: as it came.
            read: its pose, which was read already.
        """
        unsettled = self._tickets or self._calibrator.active or self._roster.has_spare
        if unsettled or self.state is not SessionState.OPEN or frame.t is None or isinstance(read, FrameError):
            return None
        body = self._roster.find(frame.body, frame.t)
        if body is None or frame.seq <= body.newest_seq:
            return None
        spread = self._host.spread
        try:
            ticket = body.plan(frame.seq, frame.t, read, emotion=frame.emotion, spread=spread)
        except InputError:
            return None  # it left no trace
        if spread is not None:
            spread.note()
        self._note(ticket)
        return ticket

    def answer(self, ticket: Ticket, outcome: Outcome | EngineError) -> Sequence[Said]:
        """What the outcome of a ticket from `prompt` brings."""
        body = self._roster.known(ticket.body)
        if isinstance(outcome, EngineError):
            return (self._failed(ticket, body, outcome),)
        self._totals["estimates"] += 1
        estimate = body.conclude(ticket, outcome)
        checkpoint = None if ticket.checkpoint is None else self._checkpoint(ticket, body, outcome)
        return (estimate,) if checkpoint is None else (estimate, checkpoint)

    def refuse(self, error: FervorError) -> list[Event]:
        """Tell the client of an error; end the session where it is fatal, or where it never began."""
        if self.state is SessionState.CLOSED:
            return []
        if not error.fatal and self.state is SessionState.NEW:
            error = ProtocolError(f"the session could not start: {error.message}")
        if isinstance(error, FrameError) and error.seq is not None:
            self._totals["rejected"] += 1
        reply = Reply(_error(error))
        return [reply, *self._close(error.close_code, error.code)] if error.close_code else [reply]

    def conclude(self, ticket: Ticket, outcome: Outcome | EngineError) -> list[Event]:
        """What a ticket's outcome brings: its estimate, or the error of a failed run, and a waiting end.

        Outcomes may come in any order over the bodies; answers leave in the order in which the frames came.
        """
        tickets, outcomes = self._tickets, self._outcomes
        if ticket not in tickets:
            return []  # of a session that is over
        if not outcomes and ticket is next(iter(tickets)):  # in order, and nothing waits for it
            return self._conclude(ticket, outcome)
        outcomes[ticket] = outcome
        events: list[Event] = []
        while tickets and (oldest := next(iter(tickets))) in outcomes:
            events += self._conclude(oldest, outcomes.pop(oldest))
        return events

    def _conclude(self, ticket: Ticket, outcome: Outcome | EngineError) -> list[Event]:
        body, place = self._tickets.pop(ticket)
        events: list[Event] = []
        if isinstance(outcome, EngineError):
            events = [Reply(self._failed(ticket, body, outcome))] if ticket.answer else []
        elif ticket.answer:
            events = self._deliver(ticket.group, place, body.conclude(ticket, outcome), body)
        if ticket.group is not None or ticket.checkpoint is not None or self._calibrated:
            events += self._follow(ticket, body, outcome)
        if self.state is SessionState.ENDING and not self._tickets:
            events += self._ended("ended by the client")
        return events

    def lost(self) -> list[Event]:
        """The connection is gone: free what the session holds."""
        if self.state is SessionState.CLOSED:
            return []
        self.state = SessionState.CLOSED
        return self._release_all()

    def interrupt(self) -> list[Event]:
        """The service stops: close so that the client goes on elsewhere."""
        if self.state is SessionState.CLOSED:
            return []
        return self._close(CloseCode.RESTART, "the service restarts; connect again and resume")

    def _dispatch(self, message: Rare) -> list[Event]:
        match message:
            case SessionStart():
                return self._start(message)
            case BodyReset():
                self._roster.known(message.body).reset()
                self._totals["resets"] += 1
                return []
            case BodyEnd():
                return [
                    self._roster.end(message.body),
                    *self._tell_gone(message.body, self._calibrator.gone(message.body)),
                ]
            case SessionCalibrate():
                self._calibrator.begin(message, self._agreed.terms.source)
                return []
            case Ping():
                return [Reply(Pong(id=message.id))]
            case SessionEnd():
                return [] if self._tickets else self._ended("ended by the client")

    def _start(self, message: SessionStart) -> list[Event]:
        try:
            self._agreement = agree(message, self._host.metadata, self._host.skeletons)
        except InputError as error:
            raise ProtocolError(error.message) from None
        joints, most = len(self._agreement.terms.source.skeleton.joints), self._host.limits.max_joints
        if joints > most:
            raise ProtocolError(f"the skeleton has {joints} joints; this service takes at most {most}")
        if message.clock == "frames":
            self._roster = Roster(self._host.claim, most=self._host.limits.max_bodies, idle_s=math.inf)
        resumed, restores = (
            resume(message.resume, self._host, bond=self._bound(), roster=self._roster, terms=self._agreement.terms)
            if message.resume
            else ((), [])
        )
        started = SessionStarted(
            session_id=self.session_id,
            model=self._host.model,
            limits=self._host.limits,
            joints=self._agreement.joints,
            fingerprint=self._host.fingerprint,
            resumed=resumed,
        )
        return [Reply(started), *restores]

    def checkpoints(self, group: int | None = None) -> list[Event]:
        """Ask for a checkpoint of every body, after all that is under way and, if any, the answers of `group`.

        None unless the client takes them, and none of a body that holds a pose for a calibration.
        """
        if self.state is not SessionState.OPEN or self._agreed.terms.checkpoint_s is None:
            return []
        tickets: list[Event] = []
        for body in self._roster:
            if body.last is not None and not self._calibrator.holds(body.name):
                ticket = body.snapshot(body.last, group)
                if group is not None:
                    self._groups.expect(group)
                self._tickets[ticket] = (body, -1)
                tickets.append(ticket)
        return tickets

    @property
    def busy(self) -> bool:
        """Whether something is under way."""
        return bool(self._tickets)

    def _bound(self) -> Bond:
        if self._bond is None:
            self._bond = Bond(self._host.model.sha256, self._host.fingerprint, self._agreed.digest)
        return self._bond

    def _follow(self, ticket: Ticket, body: Body, outcome: Outcome | EngineError) -> list[Event]:
        """What comes after a ticket's estimate: its checkpoint, and a calibration that ended with it."""
        checkpoint = self._checkpoint(ticket, body, outcome)
        if ticket.group is None:
            told: list[Event] = [Reply(checkpoint)] if checkpoint else []
            group = self._calibrated.pop(ticket, None)
            return told if group is None else told + self._close_group(group)
        if checkpoint:
            self._groups.follow(ticket.group, checkpoint)
        return self._close_group(ticket.group)

    def _checkpoint(self, ticket: Ticket, body: Body, outcome: Outcome | EngineError) -> Checkpoint | None:
        if isinstance(outcome, EngineError) or ticket.checkpoint is None or outcome.memory is None:
            return None
        if self._host.seal is None or ticket.source != self._agreed.terms.source:
            return None  # after a calibration, a state before it belongs to terms that no longer hold
        content = pack(self._bound(), body.bookkeeping(ticket), body.answers(), outcome.memory)
        return Checkpoint(body=body.name, seq=ticket.checkpoint.newest_seq, token=self._host.seal(content))

    def _frame(
        self, frame: AnyFrame, read: Read | None = None, group: int | None = None, place: int = 0
    ) -> list[Event]:
        """The work of one frame. A bad one is told and leaves no trace."""
        try:
            events = self._plan(frame, read, group, place)
        except FervorError as error:
            self._totals["rejected"] += 1
            events = [Reply(_error(error, frame))]
        return [*self._roster.spare(), *events] if self._roster.has_spare else events

    def _plan(self, frame: AnyFrame, read: Read | None, group: int | None, place: int) -> list[Event]:
        agreement, host, calibrator, name = self._agreed, self._host, self._calibrator, frame.body
        time = agreement.time_of(frame) if frame.t is None else frame.t
        pose = agreement.pose_of(_plain(frame)) if read is None else read
        if isinstance(pose, FrameError):
            raise pose
        body = self._roster.find(name, time)
        if body is not None and frame.seq <= body.newest_seq and (answer := body.answered(frame.seq)) is not None:
            return self._answer_again(answer, group, place)
        if frame.emotion is not None:
            emotion_vector(frame.emotion)  # before a body is opened for it: a bad frame leaves no trace
        gone: list[Event] = []
        if body is None:
            body = self._welcome(name, time, agreement)
            gone = self._tell_gone(*calibrator.replaced(name, self._roster))
        if host.spread is not None:
            host.spread.note()
        ticket = body.plan(
            frame.seq,
            time,
            pose,
            emotion=frame.emotion,
            group=group,
            keep=not calibrator.holds(name),
            spread=host.spread,
        )
        self._tickets[ticket] = body, place
        if group is not None:
            self._groups.expect(group)
        self._note(ticket)
        return [*gone, ticket, *self._calibrate(ticket, pose)] if gone or calibrator.active else [ticket]

    def _welcome(self, name: str, time: float, agreement: Agreement) -> Body:
        return self._roster.seen(name, time, agreement.terms, lambda: agreement.first_label(time))

    def _answer_again(self, answer: LeanEstimate, group: int | None, place: int) -> list[Event]:
        self._totals["duplicate"] += 1
        if group is None:
            return [Reply(answer)]
        self._groups.put(group, place, answer)
        return []

    def _frames(self, frames: Sequence[AnyFrame], poses: Sequence[Read]) -> list[Event]:
        most = self._host.limits.max_frames_per_message
        if len(frames) > most:
            raise FrameError(f"a message has {len(frames)} frames; this service takes at most {most}")
        group, agreement = self._groups.open(), self._agreement
        events: list[Event] = []
        for place, frame in enumerate(frames):
            events += self._frame(frame, poses[place] if poses else None, group, place)
        if self._agreement is not agreement:  # calibrated: the rest of the message is answered before that is told
            events += self.checkpoints(group)
        return events + self._close_group(group)

    def _close_group(self, group: int) -> list[Event]:
        gathered = self._groups.close(group)
        if gathered is None:
            return []
        answers = gathered.estimates
        if self._agreed.latest:
            answers = tuple({answer.body: answer for answer in answers}.values())
        events: list[Event] = [Reply(LeanEstimates(answers))] if answers else []
        return [*events, *map(Reply, gathered.followers)]

    def _deliver(self, group: int | None, place: int, estimate: LeanEstimate, body: Body) -> list[Event]:
        """Send an estimate, or put it with its group; delivery `latest` skips one that a newer is about to replace."""
        self._totals["estimates"] += 1
        if group is not None:
            self._groups.put(group, place, estimate)
            return []
        return [] if self._agreed.latest and body.in_flight else [Reply(estimate)]

    def _calibrate(self, ticket: Ticket, pose: Pose) -> list[Event]:
        """Hand a frame to the calibration under way; adopt its result, told once this frame is answered."""
        try:
            found = self._calibrator.add(ticket, pose)
        except InputError as error:
            return self._tell_gone(ticket.body, error)
        if found is None:
            return []
        calibration, message = found
        self._agreement, self._bond = self._agreed.aligned(calibration.skeleton), None
        for known in self._roster:
            known.adopt(self._agreement.terms)
        return self._tell_calibrated(ticket, message)

    def _tell_calibrated(self, ticket: Ticket, message: SessionCalibrated) -> list[Event]:
        """Once its last frame is answered, in one message with checkpoints under the new terms: the old ones are void.

        They cover all that is answered then: where a message has frames after that one, they come after the last.
        """
        group = self._groups.open() if ticket.group is None else ticket.group
        self._groups.follow(group, message)
        if ticket.group is not None:
            return []
        self._calibrated[ticket] = group
        return self.checkpoints(group)

    def _tell_gone(self, body: str, error: InputError | None) -> list[Event]:
        """A calibration is over without a result, if there is an error that says so."""
        return [] if error is None else [Reply(_error(error).model_copy(update={"body": body}))]

    def _failed(self, ticket: Ticket, body: Body, error: EngineError) -> Error:
        body.fail(ticket)
        return Error(code=error.code, message=error.message, fatal=False, body=ticket.body, seq=ticket.seq)

    def _ended(self, reason: str) -> list[Event]:
        return [Reply(SessionEnded(reason=reason, totals=self.totals)), *self._close(CloseCode.NORMAL, reason)]

    def _close(self, code: CloseCode, reason: str) -> list[Event]:
        self.state = SessionState.CLOSED
        return [Close(code, reason), *self._release_all()]

    def _release_all(self) -> list[Event]:
        self._tickets.clear()
        self._outcomes.clear()
        self._calibrated.clear()
        return [*self._roster.clear()]

    def _note(self, ticket: Ticket) -> None:
        self._totals["frames"] += 1
        if not ticket.flags:
            return
        self._totals["late"] += "late" in ticket.flags
        self._totals["duplicate"] += "duplicate" in ticket.flags
        self._totals["resets"] += "gap_reset" in ticket.flags or "clock_reset" in ticket.flags

    @property
    def _agreed(self) -> Agreement:
        if self._agreement is None:
            raise ProtocolError("the session has not started")
        return self._agreement


def _plain(frame: AnyFrame) -> Frame:
    return frame.to_frame() if isinstance(frame, RawFrame) else frame


def _error(error: FervorError, frame: AnyFrame | None = None) -> Error:
    """The wire form of an error; one that a frame caused names the frame and ends nothing."""
    return Error(
        code=error.code,
        message=error.message,
        fatal=error.fatal and frame is None,
        body=frame.body if frame else getattr(error, "body", None),
        seq=frame.seq if frame else getattr(error, "seq", None),
        retry_after=error.retry_after,
    )
