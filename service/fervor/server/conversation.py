"""The talk of a conversation: messages go to a session, its tickets to the batcher, its replies back to the client.

Rules. The session decides everything; this edge adds only what needs a clock or a socket: the pace, what becomes of a
slow reader and, in `Life`, the timeouts. All sends pass one outbox, so they leave in the order in which the session
said them. A frame never waits for another session's client. Nothing that one client sends can raise beyond its own
conversation.
"""

from collections.abc import Hashable, Iterable, Sequence
from typing import assert_never

from fervor.errors import EngineError, FervorError, MessageError, Overloaded
from fervor.protocol.codec import Codec
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import (
    Checkpoint,
    ClientMessage,
    Frames,
    GoingAway,
    SessionCalibrated,
    SessionStart,
    SessionStarted,
)
from fervor.server.life import REASONS, Life
from fervor.server.pace import Pace
from fervor.server.service import Service
from fervor.server.wire import Wire
from fervor.session.events import Close, Event, Outcome, Release, Reply, Restore, Said, Ticket
from fervor.session.poses import Read
from fervor.session.start import Agreement
from fervor.session.state import SessionState

BYTES_A_FRAME = 1024
"""A message that can't be read uses up the pace of as many frames as it had room for."""


_ANSWERS = (LeanEstimate, LeanEstimates)


class Conversation(Life):
    """A session and its wire."""

    __slots__ = ("_codec", "_latest", "_leaving", "_pace")

    def __init__(self, wire: Wire, service: Service, codec: Codec, *, client: str | None = None) -> None:
        """Begin.

        Args:
            wire: to the client.
            service: that the session runs in.
            codec: what was agreed on.
            client: the name of the client's token, for logs.
        """
        super().__init__(wire, service, client=client)
        self._codec = codec
        self._leaving = False
        self._latest = False  # whether the client wants the newest estimates only
        self._pace = Pace(service.settings.max_frames_per_second, service.settings.max_frames_per_message)

    @property
    def _encoding(self) -> str:
        return self._codec.subprotocol

    def go_away(self, seconds: float) -> None:
        """The service stops: take no more frames, send the last checkpoints, and close with 1012 after them."""
        self._leaving = True
        if self._session.state is not SessionState.CLOSED:
            self._say(GoingAway(seconds=seconds))
        self._carry_out(self._session.checkpoints())
        self._leave_when_done()

    def send_away(self, retry_after: float) -> None:
        """Close with 1013: there is more load than the service can bear; `retry_after` is in seconds."""
        error = Overloaded("this service is late with its frames; resume elsewhere, or later", retry_after=retry_after)
        self._end(error, "shed")

    def _end(self, error: FervorError, reason: str) -> None:
        """End the session with an error, for a reason that is not in its code."""
        if self._session.state is not SessionState.CLOSED:
            self._carry_out(self._session.refuse(error))
            self._reason = reason

    def _leave_when_done(self) -> None:
        if self._leaving and not self._session.busy:
            self._carry_out(self._session.interrupt())

    @property
    def agreement(self) -> Agreement | None:
        """See `Taker`."""
        return self._session.agreement

    def decode_frames(self, message: str | bytes) -> LeanFrame | LeanFrames | None:
        """See `Taker`."""
        return self._codec.decode_frames(message)

    def take(self, message: str | bytes, lean: LeanFrame | LeanFrames | None, poses: Sequence[Read]) -> None:
        """See `Taker`."""
        self._in_turn -= 1
        if self._waits_for_answers:
            self._make_room()
        if self._session.state is not SessionState.CLOSED:
            self._act_on(message, lean, poses)

    def prompt(self, message: LeanFrame | LeanFrames, poses: Sequence[Read]) -> Sequence[Ticket]:
        """See `Taker`."""
        if self._leaving or not self._pace.has_room(len(poses)):
            return ()
        tickets = self._session.prompt(message, poses)
        if tickets:
            self._in_turn -= 1
            self._pace.take(len(tickets), self._heard)
            for ticket in tickets:
                if ticket.flags:
                    self._note_gap(ticket)
        return tickets

    def answer(self, tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> None:
        """See `Taker`."""
        if self._waits_for_answers:
            self._make_room()
        try:
            for said in self._session.answer(tickets, outcomes):
                self._say(said)
            self._end_if_slow()
        except Exception as fault:  # noqa: BLE001  # as below
            self._give_up(fault)

    def _act_on(
        self, data: str | bytes, lean: LeanFrame | LeanFrames | None = None, poses: Sequence[Read] = ()
    ) -> None:
        if self._leaving:
            return  # what comes now is after the last checkpoint: the client sends it again where it resumes
        try:
            self._carry_out(self._understand(data, lean, poses))
        except Exception as fault:  # noqa: BLE001  # a fault of ours ends this session with a word, and no other
            self._give_up(fault)

    def _understand(self, data: str | bytes, lean: LeanFrame | LeanFrames | None, poses: Sequence[Read]) -> list[Event]:
        """What a message brings. Whatever it is, it counts as a frame of the pace, at least."""
        try:
            self._pace.take(1, self._heard)
            message = lean or self._decode(data)
            if isinstance(message, LeanFrames | Frames):
                more = min(len(message.frames), self._settings.max_frames_per_message) - 1
                self._pace.take(more, self._heard)
        except FervorError as error:
            return self._session.refuse(error)
        if isinstance(message, SessionStart):
            self._latest = message.delivery == "latest"
        return self._session.receive(message, poses)

    def _decode(self, data: str | bytes) -> ClientMessage:
        try:
            return self._codec.decode_client(data)
        except MessageError:
            self._pace.take(len(data) // BYTES_A_FRAME, self._heard)
            raise

    def _carry_out(self, events: Iterable[Event]) -> None:
        """Do what the session asks, in its order."""
        for event in events:
            if isinstance(event, Ticket):
                self._unanswered += 1
                if event.flags:
                    self._note_gap(event)
                self._batcher.submit(event, self._deliver)
            elif isinstance(event, Reply):
                self._say(event.message)
            else:
                self._carry_out_rare(event)
        self._end_if_slow()

    def _note_gap(self, ticket: Ticket) -> None:
        self._traffic.gaps += "held" in ticket.flags or "gap_reset" in ticket.flags

    def _end_if_slow(self) -> None:
        if self._outbox.full and self._session.state is not SessionState.CLOSED:
            self._outbox.drop()
            self._end(Overloaded("the client reads its answers too slowly"), "slow_reader")

    def _carry_out_rare(self, event: Release | Restore | Close) -> None:
        match event:
            case Release():
                self._batcher.release(event.slot)
            case Restore():
                self._restore(event)
            case Close():
                self._reason = REASONS.get(event.code, event.reason)
                self._outbox.put(event)
                self._leave_soon()
            case _:
                assert_never(event)

    def _say(self, message: Said) -> None:
        """Send a message, in place of one that waits and says less."""
        encoded = self._codec.encode(message)
        if isinstance(message, _ANSWERS):
            self._outbox.put(encoded, topic=_topic(message) if self._latest else None)
            return
        topic: Hashable = None
        match message:
            case Checkpoint():
                topic = ("checkpoint", message.body)
                self._traffic.checkpoints += 1
                self._traffic.checkpoint_bytes += len(encoded)
            case SessionCalibrated():
                self._traffic.checkpoints += len(message.checkpoints)
                self._traffic.checkpoint_bytes += sum(len(each.token) for each in message.checkpoints)
            case SessionStarted():
                self._traffic.resumed += len(message.resumed)
        self._outbox.put(encoded, topic=topic)

    def _restore(self, event: Restore) -> None:
        try:
            self._batcher.engine.restore(event.slot, event.memory)
        except FervorError as error:
            self._carry_out(self._session.refuse(error))

    def _deliver(self, ticket: Ticket, outcome: Outcome | EngineError) -> None:
        self._unanswered -= 1
        if self._waits_for_answers:
            self._make_room()
        try:
            self._carry_out(self._session.conclude(ticket, outcome))
            if self._leaving:
                self._leave_when_done()
        except Exception as fault:  # noqa: BLE001  # as above
            self._give_up(fault)

    def _give_up(self, fault: Exception) -> None:
        self._log.error("the session failed", exc_info=fault)
        self._carry_out(self._session.refuse(FervorError("the service failed on this session; the fault is its own")))


def _topic(message: LeanEstimate | LeanEstimates) -> Hashable:
    """What delivery `latest` knows an answer by: a newer one of the same replaces it."""
    answers = (message,) if isinstance(message, LeanEstimate) else message.estimates
    return ("estimate", *(answer.body for answer in answers))
