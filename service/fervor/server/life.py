"""The life of a conversation, whatever it is about: who may speak, for how long, and how it ends.

It takes messages from a wire and holds back a client that is far ahead, or all of them where too much waits; it closes
what never began or fell silent, leaves a client behind that does not take its close, and signs off.
"""

import asyncio
import logging
import secrets
from abc import abstractmethod
from collections.abc import Iterable

from fervor.errors import CloseCode, FervorError, IdleTimeout, StartTimeout
from fervor.protocol.messages import Totals
from fervor.server.draining import Leaving
from fervor.server.outbox import Outbox
from fervor.server.service import Service
from fervor.server.traffic import Traffic
from fervor.server.turn import Taker
from fervor.server.wire import Wire
from fervor.session.events import Event
from fervor.session.session import Session
from fervor.session.state import SessionState

log = logging.getLogger(__name__)

CLOSE_GRACE_S = 5.0
"""Seconds that a client has to take a close before it is left behind."""

GONE = "gone"
"""Why a session ended whose client left without a word."""

REASONS = {CloseCode.NORMAL: "ended", CloseCode.RESTART: "restart"}
"""Why a session ended, for programs; otherwise the code of the error that ended it."""


class Life(Taker, Leaving):
    """A session on a wire, from its first message to its last."""

    def __init__(self, wire: Wire, service: Service, *, client: str | None) -> None:
        """Begin.

        Args:
            wire: to the client.
            service: that the session runs in.
            client: the name of the client's token, for logs.
        """
        self._wire = wire
        self._settings = service.settings
        self._turn = service.turn
        self._backlog = service.backlog
        self._drain = service.drain
        self._metrics = service.metrics
        self._tracing = service.tracing
        self._session = Session(secrets.token_hex(8), service.host)
        self._about = {"session": self._session.session_id, "client": client}
        self._log = logging.LoggerAdapter(log, self._about)
        self._reason = GONE
        self._traffic = Traffic()
        self._outbox = Outbox(wire, most_bytes=service.settings.max_unsent_bytes)
        self._loop = asyncio.get_running_loop()
        self._opened = self._heard = self._loop.time()  # seconds; `heard`: when the newest message came
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
        self._log.info("session begun (%s)", self._encoding)
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

    # What it is about.

    @property
    @abstractmethod
    def _encoding(self) -> str:
        """What was agreed on, for logs."""

    @abstractmethod
    def _act_on(self, data: str | bytes) -> None:
        """Do what a message asks. Never raises."""

    @abstractmethod
    def _carry_out(self, events: Iterable[Event]) -> None:
        """Do what the session asks."""

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

    def _make_room(self) -> None:
        """Let `_listen` look whether there is room for more."""
        if self._room is not None and not self._room.done():
            self._room.set_result(None)

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
