"""One conversation: messages in, events out. The edge carries them out in order and brings outcomes back.

The caller's duties: hand every message to `receive` (or, if it could not be decoded, its error to `refuse`); submit
every `Ticket` to the engine in order and hand each outcome to `conclude`; call `lost` once when the connection is gone.
Messages of frames may be offered to `prompt` first.
"""

from collections.abc import Iterable, Sequence

from fervor.errors import CloseCode, EngineError, FervorError, FrameError, InputError, ProtocolError
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import (
    BodyEnd,
    BodyReset,
    Frame,
    Frames,
    Ping,
    Pong,
    SessionCalibrate,
    SessionEnd,
    SessionEnded,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor.session.body import Body
from fervor.session.events import Close, Event, Outcome, Reply, Said, Source, Ticket
from fervor.session.following import AnyFrame, Following
from fervor.session.host import Host
from fervor.session.poses import Read
from fervor.session.refusal import refusal
from fervor.session.start import Agreement, agree
from fervor.session.state import SessionState, transition

Rare = SessionStart | BodyReset | BodyEnd | SessionCalibrate | Ping | SessionEnd
"""What comes now and then."""

Incoming = AnyFrame | Frames | LeanFrames | Rare
"""A client's message, with frames in either form."""


class Session:
    """One client's conversation."""

    def __init__(self, session_id: str, host: Host) -> None:
        self.session_id = session_id
        self.state = SessionState.NEW
        self._host = host
        self._following: Following | None = None  # from its start on
        self._counts = Totals().model_dump()

    @property
    def totals(self) -> Totals:
        """What the session came to so far."""
        return Totals(**self._counts)

    @property
    def bodies(self) -> Iterable[Body]:
        """The bodies that it follows, in the order in which they came."""
        return () if self._following is None else self._following.bodies

    @property
    def source(self) -> Source | None:
        """What kind of joints it gets; None before its start."""
        return None if self._following is None else self._following.agreement.terms.source

    @property
    def agreement(self) -> Agreement | None:
        """What was agreed on; None before the start."""
        return None if self._following is None else self._following.agreement

    @property
    def busy(self) -> bool:
        """Whether something is under way."""
        return self._following is not None and self._following.busy

    def receive(self, message: Incoming, poses: Sequence[Read] = ()) -> list[Event]:
        """What a message brings. Errors come back as replies; a fatal one is followed by `Close`.

        Args:
            message: as it came.
            poses: of its frames, where they were read already.
        """
        try:
            self.state = transition(self.state, message.type)
            if isinstance(message, LeanFrame | Frame):
                return self._started.frame(message, poses[0] if poses else None)
            if isinstance(message, LeanFrames | Frames):
                return self._started.frames(message.frames, poses)
            return self._dispatch(message)
        except FervorError as error:
            return self.refuse(error)

    def prompt(self, message: LeanFrame | LeanFrames, poses: Sequence[Read]) -> Sequence[Ticket]:
        """The tickets of frames about which nothing is unusual, as nearly all are; none: `receive` is to take them.

        For a caller that runs the tickets, and hands their outcomes to `answer`, before anything else of this session:
        then nothing need be kept of them meanwhile. What comes of it is the same.

        Args:
            message: as it came.
            poses: of its frames, which were read already.
        """
        following = self._following
        if following is None or self.state is not SessionState.OPEN:
            return ()
        return following.prompt(message, poses)

    def answer(self, tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> Sequence[Said]:
        """What the outcomes of tickets from `prompt` bring."""
        return self._started.answer(tickets, outcomes)

    def refuse(self, error: FervorError) -> list[Event]:
        """Tell the client of an error; end the session where it is fatal, or where it never began."""
        if self.state is SessionState.CLOSED:
            return []
        if not error.fatal and self.state is SessionState.NEW:
            error = ProtocolError(f"the session could not start: {error.message}")
        if isinstance(error, FrameError) and error.seq is not None:
            self._counts["rejected"] += 1
        reply = Reply(refusal(error))
        return [reply, *self._close(error.close_code, error.code)] if error.close_code else [reply]

    def conclude(self, ticket: Ticket, outcome: Outcome | EngineError) -> list[Event]:
        """What a ticket's outcome brings: its estimate, or the error of a failed run, and a waiting end."""
        events = self._started.conclude(ticket, outcome)
        if self.state is SessionState.ENDING and not self.busy:
            events += self._ended("ended by the client")
        return events

    def checkpoints(self) -> list[Event]:
        """Ask for a checkpoint of every body, after all that is under way; none unless the client takes them."""
        return self._started.checkpoints() if self.state is SessionState.OPEN else []

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
                self._started.reset(message.body)
                return []
            case BodyEnd():
                return self._started.end(message.body)
            case SessionCalibrate():
                self._started.calibrate(message)
                return []
            case Ping():
                return [Reply(Pong(id=message.id))]
            case SessionEnd():
                return [] if self.busy else self._ended("ended by the client")

    def _start(self, message: SessionStart) -> list[Event]:
        try:
            agreement = agree(message, self._host.metadata, self._host.skeletons)
        except InputError as error:
            raise ProtocolError(error.message) from None
        joints, most = len(agreement.terms.source.skeleton.joints), self._host.limits.max_joints
        if joints > most:
            raise ProtocolError(f"the skeleton has {joints} joints; this service takes at most {most}")
        self._following = Following(agreement, self._host, self._counts)
        resumed, restores = self._following.resume(message.resume) if message.resume else ((), [])
        started = SessionStarted(
            session_id=self.session_id,
            model=self._host.model,
            limits=self._host.limits,
            joints=agreement.joints,
            fingerprint=self._host.fingerprint,
            resumed=resumed,
        )
        return [Reply(started), *restores]

    def _ended(self, reason: str) -> list[Event]:
        return [Reply(SessionEnded(reason=reason, totals=self.totals)), *self._close(CloseCode.NORMAL, reason)]

    def _close(self, code: CloseCode, reason: str) -> list[Event]:
        self.state = SessionState.CLOSED
        return [Close(code, reason), *self._release_all()]

    def _release_all(self) -> list[Event]:
        return [] if self._following is None else self._following.release_all()

    @property
    def _started(self) -> Following:
        if self._following is None:
            raise ProtocolError("the session has not started")
        return self._following
