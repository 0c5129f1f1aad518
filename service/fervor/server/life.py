"""The life of a conversation, whatever it is about: who may speak, for how long, and how it ends.

It lives by calls, and has no task: a message came, the wire takes more, there is room for more, time has passed, the
connection is gone. It holds back a client that is far ahead, and all of them where too much waits; it closes what never
began or fell silent, leaves a client behind that does not take its close, and signs off.
"""

import asyncio
import logging
import secrets
from abc import abstractmethod
from collections import deque
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

    __slots__ = (
        "_backlog",
        "_batcher",
        "_client",
        "_grace",
        "_heard",
        "_held",
        "_in_turn",
        "_loop",
        "_most_unanswered",
        "_opened",
        "_outbox",
        "_over",
        "_reason",
        "_service",
        "_session",
        "_settings",
        "_traffic",
        "_turn",
        "_unanswered",
        "_waits_for_answers",
        "_wire",
    )

    def __init__(self, wire: Wire, service: Service, *, client: str | None) -> None:
        """Begin; `service.sessions` admitted it.

        Args:
            wire: to the client.
            service: that the session runs in.
            client: the name of the client's token, for logs.
        """
        self._wire = wire
        self._service = service
        self._settings = service.settings
        self._turn = service.turn
        self._batcher = service.batcher
        self._backlog = service.backlog
        self._client = client
        self._session = Session(secrets.token_hex(8), service.host)
        self._reason = GONE
        self._traffic = Traffic()
        self._outbox = Outbox(wire, most_bytes=service.settings.max_unsent_bytes)
        self._loop = asyncio.get_running_loop()
        self._opened = self._heard = self._loop.time()  # seconds; `heard`: when the newest message came
        self._unanswered = 0
        self._most_unanswered = service.settings.max_unanswered_frames
        self._in_turn = 0  # messages that wait for the end of a turn
        self._held: deque[str | bytes] | None = None  # messages that are held back, while some are
        self._waits_for_answers = False  # whether those wait for answers, rather than for others' frames
        self._grace: asyncio.TimerHandle | None = None  # until the client must have taken its close
        self._over = False

    async def run(self) -> None:
        """Live; returns at once where the wire needs nobody to wait on it."""
        self._service.drain.enter(self)
        self._log.info("session begun (%s)", self._encoding)
        await self._wire.carry(self)

    # What it is about.

    @property
    @abstractmethod
    def _encoding(self) -> str:
        """What was agreed on, for logs."""

    @abstractmethod
    def _carry_out(self, events: Iterable[Event]) -> None:
        """Do what the session asks."""

    @property
    def session(self) -> Session:
        """See `Leaving`."""
        return self._session

    @property
    def totals(self) -> Totals:
        """See `Leaving`."""
        return self._session.totals

    @property
    def traffic(self) -> Traffic:
        """See `Leaving`."""
        self._traffic.bytes_out = self._outbox.bytes_sent
        self._traffic.superseded = self._outbox.superseded
        return self._traffic

    # What comes.

    def came(self, message: str | bytes) -> None:
        """See `Listener`: it is taken with all of its turn, unless something holds it back."""
        self._heard = self._loop.time()
        self._traffic.bytes_in += len(message)
        waiting = self._unanswered + self._in_turn
        if self._held is not None or waiting >= self._most_unanswered or self._backlog.full:
            self._hold(message)
            return
        self._in_turn += 1
        self._turn.put(self, message)

    @property
    def _has_enough(self) -> bool:
        """Whether so many frames are unanswered that no more are taken just now."""
        return self._unanswered + self._in_turn >= self._most_unanswered

    def _hold(self, message: str | bytes) -> None:
        if self._held is None:
            self._held = deque()
            self._wire.pause()
            self._wait()
        self._held.append(message)

    def _wait(self) -> None:
        self._waits_for_answers = self._has_enough
        if not self._waits_for_answers:
            self._backlog.wait(self._go_on)

    def _make_room(self) -> None:
        """A message or an answer is done with: look, once that has had its effect, whether there is room for more."""
        if self._waits_for_answers:
            self._waits_for_answers = False
            self._loop.call_soon(self._go_on)

    def _go_on(self) -> None:
        """Take what was held back, as far as there is room."""
        while self._held and not (self._has_enough or self._backlog.full):
            self._in_turn += 1
            self._turn.put(self, self._held.popleft())
        if self._held:
            self._wait()
        elif self._held is not None:
            self._held = None
            self._wire.resume()

    # What becomes of it.

    def writable(self) -> None:
        """See `Listener`."""
        self._outbox.flush()
        if self._outbox.closed:
            self._leave_soon()

    def look(self, now: float) -> None:
        """See `Leaving`."""
        settings, error = self._settings, FervorError
        if self._session.state is SessionState.CLOSED:
            return
        if self._session.state is SessionState.NEW:
            error, until = StartTimeout, self._opened + settings.start_timeout_s
            sentence = f"no session.start came for {settings.start_timeout_s:g} s"
        else:
            error, until = IdleTimeout, self._heard + settings.idle_timeout_s
            sentence = f"nothing came for {settings.idle_timeout_s:g} s"
        if until > now:
            self._wire.look(now)
        else:
            self._carry_out(self._session.refuse(error(sentence)))

    def _leave_soon(self) -> None:
        """The last word was said: the client has a little time to take what is left."""
        if self._outbox.closed:
            self._loop.call_soon(self.lost)  # what is done just now is to be finished first
        elif self._grace is None and not self._over:
            self._wire.pause()  # who may not be heard any more should find that out, rather than go on
            self._grace = self._loop.call_later(CLOSE_GRACE_S, self._leave_behind)

    def _leave_behind(self) -> None:
        self._log.info("the client did not take its close")
        self.lost()

    def lost(self) -> None:
        """See `Listener`: free what the session held, and sign off."""
        if self._over:
            return
        self._over = True
        if self._grace is not None:
            self._grace.cancel()
        self._held = None
        self._outbox.drop()
        self._service.drain.leave(self)
        self._service.sessions.leave()
        self._carry_out(self._session.lost())
        self._wire.leave()
        self._sign_off()

    def _sign_off(self) -> None:
        totals, seconds = self.totals, self._loop.time() - self._opened
        self._service.metrics.note_end(self._reason)
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
        self._service.tracing.note_session(seconds, {**about, "reason": self._reason, **totals.model_dump()})

    @property
    def _about(self) -> dict[str, str | None]:
        return {"session": self._session.session_id, "client": self._client}

    @property
    def _log(self) -> logging.LoggerAdapter[logging.Logger]:
        return logging.LoggerAdapter(log, self._about)
