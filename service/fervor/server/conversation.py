"""One wire: carries messages to a session, its tickets to the batcher, and its replies back to the client.

Rules. The session decides everything; this edge adds only what needs a clock or a socket: the two timeouts, the pace,
and what becomes of a slow reader. All sends pass one outbox, so they leave in the order in which the session said
them. A frame never waits for another session's client. Nothing that one client sends can raise beyond its own
conversation.
"""

import asyncio
import logging
import secrets
from collections.abc import Hashable, Iterable, Sequence
from typing import assert_never

from fervor.errors import CloseCode, EngineError, FervorError, IdleTimeout, MessageError, Overloaded, StartTimeout
from fervor.protocol.codec import Codec
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.messages import (
    Checkpoint,
    ClientMessage,
    Frames,
    GoingAway,
    SessionCalibrated,
    SessionStart,
    SessionStarted,
    Totals,
)
from fervor.protocol.raw_frame import RawFrame, RawFrames
from fervor.server.outbox import Outbox
from fervor.server.pace import Pace
from fervor.server.service import Service
from fervor.server.traffic import Traffic
from fervor.server.wire import Wire
from fervor.session.events import Close, Event, Outcome, Release, Reply, Restore, Said, Ticket
from fervor.session.poses import Read
from fervor.session.session import Session
from fervor.session.start import Agreement
from fervor.session.state import SessionState

log = logging.getLogger(__name__)

CLOSE_GRACE_S = 5.0
"""Seconds that a client has to take a close before it is left behind."""

BYTES_A_FRAME = 1024
"""A message that can't be read uses up the pace of as many frames as it had room for."""

GONE = "gone"
"""Why a session ended whose client left without a word."""

REASONS = {CloseCode.NORMAL: "ended", CloseCode.RESTART: "restart"}
"""Why a session ended, for programs; otherwise the code of the error that ended it."""


class Conversation:
    """A session and its wire."""

    def __init__(self, wire: Wire, service: Service, codec: Codec, *, client: str | None = None) -> None:
        """Begin.

        Args:
            wire: to the client.
            service: that the session runs in.
            codec: what was agreed on.
            client: the name of the client's token, for logs.
        """
        self._wire = wire
        self._codec = codec
        self._settings = service.settings
        self._batcher = service.batcher
        self._turn = service.turn
        self._backlog = service.backlog
        self._drain = service.drain
        self._metrics = service.metrics
        self._tracing = service.tracing
        self._leaving = False
        self._latest = False  # whether the client wants the newest estimates only
        self._session = Session(secrets.token_hex(8), service.host)
        self._about = {"session": self._session.session_id, "client": client}
        self._log = logging.LoggerAdapter(log, self._about)
        self._reason = GONE
        self._traffic = Traffic()
        self._outbox = Outbox(wire, most_bytes=service.settings.max_unsent_bytes)
        self._loop = asyncio.get_running_loop()
        self._opened = self._heard = self._loop.time()  # seconds; `heard`: when the newest message came
        self._pace = Pace(service.settings.max_frames_per_second, service.settings.max_frames_per_message)
        self._unanswered = 0
        self._in_turn = 0  # messages that wait for the end of a turn
        self._waits_for_message = False
        self._room: asyncio.Future[None] | None = None  # while no more are taken: when some may be
        self._patience = asyncio.timeout(None)
        soonest = min(service.settings.start_timeout_s, service.settings.idle_timeout_s)
        self._watch = self._loop.call_later(soonest, self._look)

    async def run(self) -> None:
        """Talk until either side closes, then free what the session held."""
        sender = asyncio.create_task(self._send_all())
        self._drain.enter(self)
        self._log.info("session begun (%s)", self._codec.subprotocol)
        try:
            async with self._patience:
                await self._listen()
                if self._session.state is SessionState.CLOSED:
                    await sender
        except TimeoutError:
            self._log.info("the client did not take its close")
        finally:
            self._watch.cancel()
            self._drain.leave(self)
            self._carry_out(self._session.lost())
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)
            self._sign_off()

    async def _listen(self) -> None:
        """Take messages until the end; hold back a client far ahead of its answers, and all when too much waits."""
        self._wire.listen(self._take_at_once)
        while self._session.state is not SessionState.CLOSED:
            self._waits_for_message = True
            message = await self._wire.receive()
            self._waits_for_message = False
            if message is None:
                return
            self._note(message)
            if self._backlog.full:
                await self._backlog.wait()
            self._act_on(message)
            while self._has_enough:
                self._room = self._loop.create_future()
                await self._room

    def _take_at_once(self, message: str | bytes) -> bool:
        """Take a message with all of its turn, unless something holds it back: then `_listen` gets it."""
        if not self._waits_for_message or self._backlog.full or self._has_enough:
            return False
        if self._session.state is SessionState.CLOSED:
            return False
        self._note(message)
        self._in_turn += 1
        self._turn.put(self, message)
        return True

    def _note(self, message: str | bytes) -> None:
        self._heard = self._loop.time()
        self._traffic.bytes_in += len(message)

    @property
    def _has_enough(self) -> bool:
        """Whether so many frames are unanswered that no more are taken just now."""
        return self._unanswered + self._in_turn >= self._settings.max_unanswered_frames

    def _sign_off(self) -> None:
        totals, seconds = self.totals, self._loop.time() - self._opened
        self._metrics.note_end(self._reason)
        log.info(
            "session ended: %s, after %.1f s, %d frames, %d estimates, %d rejected",
            self._reason,
            seconds,
            totals.frames,
            totals.estimates,
            totals.rejected,
            extra={**self._about, "reason": self._reason, "totals": totals.model_dump()},
        )
        about = {name: value for name, value in self._about.items() if value}
        self._tracing.note_session(seconds, {**about, "reason": self._reason, **totals.model_dump()})

    @property
    def traffic(self) -> Traffic:
        """What went over the wire so far."""
        self._traffic.bytes_out = self._outbox.bytes_sent
        self._traffic.superseded = self._outbox.superseded
        return self._traffic

    @property
    def totals(self) -> Totals:
        """What it came to so far."""
        return self._session.totals

    @property
    def session(self) -> Session:
        """What it is about, for who watches."""
        return self._session

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

    def decode_raw(self, message: str | bytes) -> RawFrame | RawFrames | None:
        """See `Taker`."""
        return self._codec.decode_raw(message)

    def take(self, message: str | bytes, raw: RawFrame | RawFrames | None, poses: Sequence[Read]) -> None:
        """See `Taker`."""
        self._in_turn -= 1
        if self._room is not None:
            self._make_room()
        if self._session.state is not SessionState.CLOSED:
            self._act_on(message, raw, poses)

    def prompt(self, frame: RawFrame, read: Read) -> Ticket | None:
        """See `Taker`."""
        if self._leaving or not self._pace.has_room:
            return None
        ticket = self._session.prompt(frame, read)
        if ticket is not None:
            self._in_turn -= 1
            self._pace.take(1, self._heard)
            if ticket.flags:
                self._note_gap(ticket)
        return ticket

    def answer(self, ticket: Ticket, outcome: Outcome | EngineError) -> None:
        """See `Taker`."""
        if self._room is not None:
            self._make_room()
        try:
            for said in self._session.answer(ticket, outcome):
                self._say(said)
            self._end_if_slow()
        except Exception as fault:  # noqa: BLE001  # as below
            self._give_up(fault)

    def _act_on(self, data: str | bytes, raw: RawFrame | RawFrames | None = None, poses: Sequence[Read] = ()) -> None:
        if self._leaving:
            return  # what comes now is after the last checkpoint: the client sends it again where it resumes
        try:
            self._carry_out(self._understand(data, raw, poses))
        except Exception as fault:  # noqa: BLE001  # a fault of ours ends this session with a word, and no other
            self._give_up(fault)

    def _understand(self, data: str | bytes, raw: RawFrame | RawFrames | None, poses: Sequence[Read]) -> list[Event]:
        """What a message brings. Whatever it is, it counts as a frame of the pace, at least."""
        try:
            self._pace.take(1, self._heard)
            message = raw or self._decode(data)
            if isinstance(message, RawFrames | Frames):
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
        if isinstance(message, LeanEstimate | LeanEstimates):
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
        if self._room is not None:
            self._make_room()
        try:
            self._carry_out(self._session.conclude(ticket, outcome))
            if self._leaving:
                self._leave_when_done()
        except Exception as fault:  # noqa: BLE001  # as above
            self._give_up(fault)

    def _make_room(self) -> None:
        """Let `_listen` look whether there is room for more."""
        if self._room is not None and not self._room.done():
            self._room.set_result(None)

    def _give_up(self, fault: Exception) -> None:
        self._log.error("the session failed", exc_info=fault)
        self._carry_out(self._session.refuse(FervorError("the service failed on this session; the fault is its own")))

    async def _send_all(self) -> None:
        try:
            await self._outbox.send_all()
        except Exception as fault:  # noqa: BLE001  # it costs this session, and no other
            self._log.error("could not send", exc_info=fault)
        self._leave_soon()

    def _leave_soon(self) -> None:
        """From here on the client has a little time to take what is left."""
        if self._patience.when() is None:
            self._patience.reschedule(self._loop.time() + CLOSE_GRACE_S)

    def _look(self) -> None:
        """Close a session that was not started in time, or that fell silent."""
        settings, error = self._settings, FervorError
        if self._session.state is SessionState.NEW:
            error, until = StartTimeout, self._opened + settings.start_timeout_s
            sentence = f"no session.start came for {settings.start_timeout_s:g} s"
        else:
            error, until = IdleTimeout, self._heard + settings.idle_timeout_s
            sentence = f"nothing came for {settings.idle_timeout_s:g} s"
        if until > self._loop.time():
            self._watch = self._loop.call_at(until, self._look)
        else:
            self._carry_out(self._session.refuse(error(sentence)))


def _topic(message: LeanEstimate | LeanEstimates) -> Hashable:
    """What delivery `latest` knows an answer by: a newer one of the same replaces it."""
    answers = (message,) if isinstance(message, LeanEstimate) else message.estimates
    return ("estimate", *(answer.body for answer in answers))
