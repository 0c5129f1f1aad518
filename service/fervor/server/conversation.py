"""One WebSocket: carries messages to a session, its tickets to the batcher, and its replies back to the client.

Rules. The session decides everything; this edge adds only what needs a clock or a socket: the two timeouts, the pace,
and what becomes of a slow reader. All sends pass one outbox, so they leave in the order in which the session said
them. A frame never waits for another session's client. Nothing that one client sends can raise beyond its own
conversation.
"""

import asyncio
import logging
import secrets
from collections.abc import Iterable
from typing import assert_never

from starlette.websockets import WebSocket

from fervor.errors import EngineError, FervorError, IdleTimeout, Overloaded, StartTimeout
from fervor.protocol.codec import Codec
from fervor.protocol.messages import ClientMessage, Frame, Frames, GoingAway, Totals
from fervor.server.outbox import Outbox
from fervor.server.pace import Pace
from fervor.server.service import Service
from fervor.session.events import Close, Event, Outcome, Release, Reply, Restore, Ticket
from fervor.session.session import Session
from fervor.session.state import SessionState

log = logging.getLogger(__name__)

CLOSE_GRACE_S = 5.0
"""Seconds that a client has to take a close before it is left behind."""


class Conversation:
    """A session and its socket."""

    def __init__(self, websocket: WebSocket, service: Service, codec: Codec) -> None:
        self._websocket = websocket
        self._codec = codec
        self._settings = service.settings
        self._batcher = service.batcher
        self._drain = service.drain
        self._leaving = False
        self._session = Session(secrets.token_hex(8), service.host)
        self._outbox = Outbox(websocket, most_bytes=service.settings.max_unsent_bytes)
        self._loop = asyncio.get_running_loop()
        self._opened = self._heard = self._loop.time()  # seconds; `heard`: when the newest message came
        self._pace = Pace(service.settings.max_frames_per_second, service.settings.max_frames_per_message)
        self._unanswered = 0
        self._room = asyncio.Event()
        self._patience = asyncio.timeout(None)
        soonest = min(service.settings.start_timeout_s, service.settings.idle_timeout_s)
        self._watch = self._loop.call_later(soonest, self._look)

    async def run(self) -> None:
        """Talk until either side closes, then free what the session held."""
        sender = asyncio.create_task(self._send_all())
        self._drain.enter(self)
        try:
            async with self._patience:
                await self._listen()
                if self._session.state is SessionState.CLOSED:
                    await sender
        except TimeoutError:
            log.info("session %s: the client did not take its close", self._session.session_id)
        finally:
            self._watch.cancel()
            self._drain.leave(self)
            self._carry_out(self._session.lost())
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _listen(self) -> None:
        """Take messages until the end; hold back a client that is far ahead of its answers."""
        while self._session.state is not SessionState.CLOSED:
            event = await self._websocket.receive()
            if event["type"] == "websocket.disconnect":
                return
            self._heard = self._loop.time()
            text = event.get("text")
            self._take(event["bytes"] if text is None else text)
            while self._unanswered >= self._settings.max_unanswered_frames:
                self._room.clear()
                await self._room.wait()

    @property
    def totals(self) -> Totals:
        """What it came to so far."""
        return self._session.totals

    def go_away(self, seconds: float) -> None:
        """The service stops: take no more frames, send the last checkpoints, and close with 1012 after them."""
        self._leaving = True
        if self._session.state is not SessionState.CLOSED:
            self._outbox.put(self._codec.encode(GoingAway(seconds=seconds)))
        self._carry_out(self._session.checkpoints())
        self._leave_when_done()

    def _leave_when_done(self) -> None:
        if self._leaving and not self._session.busy:
            self._carry_out(self._session.interrupt())

    def _take(self, data: str | bytes) -> None:
        if self._leaving:
            return  # what comes now is after the last checkpoint: the client sends it again where it resumes
        try:
            self._carry_out(self._understand(data))
        except Exception as fault:  # noqa: BLE001  # a fault of ours ends this session with a word, and no other
            self._give_up(fault)

    def _understand(self, data: str | bytes) -> list[Event]:
        try:
            message = self._codec.decode_client(data)
            self._pace.take(min(_frames_in(message), self._settings.max_frames_per_message), self._heard)
        except FervorError as error:
            return self._session.refuse(error)
        return self._session.receive(message)

    def _carry_out(self, events: Iterable[Event]) -> None:
        """Do what the session asks, in its order."""
        for event in events:
            match event:
                case Reply():
                    self._outbox.put(self._codec.encode(event.message))
                case Ticket():
                    self._unanswered += 1
                    self._batcher.submit(event, self._deliver)
                case Release():
                    self._batcher.release(event.slot)
                case Restore():
                    self._restore(event)
                case Close():
                    self._outbox.put(event)
                    self._leave_soon()
                case _:
                    assert_never(event)
        if self._outbox.full and self._session.state is not SessionState.CLOSED:
            self._outbox.drop()
            self._carry_out(self._session.refuse(Overloaded("the client reads its answers too slowly")))

    def _restore(self, event: Restore) -> None:
        try:
            self._batcher.engine.restore(event.slot, event.memory)
        except FervorError as error:
            self._carry_out(self._session.refuse(error))

    def _deliver(self, ticket: Ticket, outcome: Outcome | EngineError) -> None:
        self._unanswered -= 1
        self._room.set()
        try:
            self._carry_out(self._session.conclude(ticket, outcome))
            self._leave_when_done()
        except Exception as fault:  # noqa: BLE001  # as above
            self._give_up(fault)

    def _give_up(self, fault: Exception) -> None:
        log.error("session %s: failed", self._session.session_id, exc_info=fault)
        self._carry_out(self._session.refuse(FervorError("the service failed on this session; the fault is its own")))

    async def _send_all(self) -> None:
        try:
            await self._outbox.send_all()
        except Exception:
            log.exception("session %s: could not send", self._session.session_id)
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


def _frames_in(message: ClientMessage) -> int:
    if isinstance(message, Frames):
        return len(message.frames)
    return 1 if isinstance(message, Frame) else 0
