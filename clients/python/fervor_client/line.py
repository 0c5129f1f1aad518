"""The line to the service: what leaves on it in which order, and what becomes of that when it is cut.

Rules: a message leaves once per connection · while there is none, messages are kept by the log alone · on a new
connection all that the log kept leaves first, at a pace that the service bears, and what is new queues up behind.
"""

from collections import deque
from collections.abc import Callable
from enum import Enum, auto

from fervor.errors import CheckpointMismatch, CheckpointUnknown, FervorError
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import SessionStart, SessionStarted
from fervor_client.answers import Key
from fervor_client.failures import SUBPROTOCOL
from fervor_client.resuming import Log
from fervor_client.retrying import Pace, Reconnect, Retries
from fervor_client.track import Payload

STALE_S = 5.0
"""Where a service refuses the checkpoints of a resume, those are left out first that came this long before the cut."""


class Link(Enum):
    """Where a connection stands."""

    DOWN = auto()
    STARTING = auto()
    UP = auto()


class Line:
    """One connection after the other."""

    def __init__(self, start: SessionStart, retries: Retries | None, now: Callable[[], float]) -> None:
        """`retries`: when to try again after a cut; None: the first one is the end."""
        self.link = Link.DOWN
        self.reconnects = 0
        self.fault: FervorError | None = None
        """What the service told before it hung up."""
        self.log = Log(
            CODECS[SUBPROTOCOL],
            latest=start.delivery == "latest",
            emotion_ttl_s=start.emotion_ttl_s,
            idles=start.clock == "time",
            keeps=retries is not None,
            now=now,
        )
        self._retries = retries
        self._now = now
        self._queue: deque[Payload] = deque()
        self._pace: Pace | None = None  # while a backlog leaves
        self._tokens: tuple[str, ...] = ()

    @property
    def resumes(self) -> bool:
        """Whether it outlives a cut."""
        return self._retries is not None

    @property
    def pause_s(self) -> float:
        """Seconds to wait before the next payload, while a backlog leaves that the service would find too fast."""
        return self._pace.wait_s() if self._pace is not None and self._queue else 0.0

    def post(self, payload: Payload) -> None:
        """Send this now or, from the log, once there is a connection."""
        if self.link is Link.UP:
            self._queue.append(payload)

    def next_payload(self) -> Payload | None:
        """What to send next, if anything."""
        if self.link is not Link.UP or not self._queue:
            self._pace = None
            return None
        if self._pace is not None:
            self._pace.take()
        return self._queue.popleft()

    def resume(self, start: SessionStart, started: SessionStarted) -> SessionStart:
        """The `session.start` for a new connection, in place of the one that `started`."""
        self.link = Link.STARTING
        self._tokens = self.log.tokens(started.limits.max_message_bytes)
        return start.model_copy(update={"resume": self._tokens})

    def resumed(self, started: SessionStarted) -> tuple[Reconnect, list[Key]]:
        """The new connection stands: what to tell of it, and the frames that are sent again though answered before."""
        assert self._retries is not None, "only a line that outlives a cut resumes"
        self.log.resumed(started.resumed)
        payloads, echoes = self.log.replay()
        self.link = Link.UP
        self._queue.extend(payloads)
        self._pace = Pace(started.limits.max_frames_per_second, self._now)
        self._retries.connected()
        self.reconnects += 1
        news = Reconnect(
            self._retries.reason,
            self._retries.attempt,
            self._retries.seconds,
            anew=tuple(sorted(self.log.anew)),
            exact=all(body.same_runtime for body in started.resumed),
        )
        return news, echoes

    def cut(self, failure: FervorError) -> FervorError:
        """The connection is gone: why, as the service told it, or else `failure`."""
        reason, self.fault, self.link = self.fault or failure, None, Link.DOWN
        self._queue.clear()
        return reason

    def again(self, reason: FervorError) -> Reconnect | None:
        """When to connect again after `reason`; None: not any more, see `surrender`."""
        assert self._retries is not None, "only a line that outlives a cut connects again"
        delay = self._retries.failed(reason, curable=self._leave_out(reason))
        if delay is None:
            return None
        return Reconnect(reason, self._retries.attempt, self._retries.seconds, delay)

    def surrender(self) -> FervorError:
        """The error to end with."""
        assert self._retries is not None, "only a line that outlives a cut gives up"
        return self._retries.surrender()

    def progress(self) -> None:
        """A frame was answered for the first time."""
        if self._retries is not None:
            self._retries.answered()

    def _leave_out(self, reason: FervorError) -> bool:
        """Where a service refused the checkpoints of a resume: choose fewer for the next; whether that was so."""
        tokens, self._tokens = self._tokens, ()
        if not tokens:
            return False
        if isinstance(reason, CheckpointMismatch):
            return self.log.refuse_tokens()
        if isinstance(reason, CheckpointUnknown):
            assert self._retries is not None, "only a resume sends checkpoints"
            cut = self._now() - self._retries.seconds
            return self.log.refuse_tokens(older_than=cut - STALE_S) or self.log.refuse_tokens()
        return False
