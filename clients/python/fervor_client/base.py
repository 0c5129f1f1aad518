"""What the async and the sync session share: all that needs no waiting."""

import logging
from collections.abc import Callable, Iterable

from fervor.errors import FervorError
from fervor.protocol.messages import Limits, ModelInfo, SessionStarted
from fervor_client.conversation import Conversation, News
from fervor_client.dialling import Way
from fervor_client.retrying import Reconnect

logger = logging.getLogger("fervor_client")

WINDOW = 256
"""Most frames under way: eight seconds of a 30 Hz sensor. Then sending waits for answers."""

RETRY_FOR_S = 60.0
"""How long a cut is tried to mend: a robot drives out of the dead spot, a service is deployed anew."""

OnError = Callable[[FervorError], None]
OnReconnect = Callable[[Reconnect], None]


def log_error(error: FervorError) -> None:
    """What happens to a recoverable error that nobody awaits, unless `connect` is told otherwise."""
    logger.warning("%s", error)


def log_reconnect(news: Reconnect) -> None:
    """What happens on the way from a cut to a stream that goes on, unless `connect` is told otherwise."""
    if news.delay_s is not None:
        logger.warning("%s; attempt %d to reconnect follows in %.1f s", news.reason, news.attempt, news.delay_s)
        return
    lost = f"; these bodies begin anew: {', '.join(news.anew)}" if news.anew else ""
    near = "" if news.exact else "; on another kind of machine, so estimates are equal to 1e-6 only"
    logger.warning("the stream goes on after %.1f s%s%s", news.seconds, lost, near)


class BaseSession:
    """The facts of a session."""

    def __init__(
        self,
        way: Way,
        conversation: Conversation,
        *,
        window: int = WINDOW,
        on_error: OnError = log_error,
        on_reconnect: OnReconnect = log_reconnect,
    ) -> None:
        self._way = way
        self._conversation = conversation
        self._window = window
        self._on_error = on_error
        self._on_reconnect = on_reconnect
        self._pumping = False

    @property
    def started(self) -> SessionStarted:
        """What the service said at the start, or when the session was resumed: model, limits, joints, fingerprint."""
        started = self._conversation.started
        assert started is not None, "connect hands out started sessions only"
        return started

    @property
    def model(self) -> ModelInfo:
        """The model that answers."""
        return self.started.model

    @property
    def limits(self) -> Limits:
        """What the service takes from one session."""
        return self.started.limits

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints of every pose, in this order."""
        return self.started.joints

    @property
    def in_flight(self) -> int:
        """Frames sent and not yet answered."""
        return self._conversation.in_flight

    @property
    def reconnects(self) -> int:
        """Times that the stream was cut and went on."""
        return self._conversation.reconnects

    def _has_room(self) -> bool:
        """Whether a frame can be sent, or fails, without waiting."""
        return self._conversation.in_flight < self._window or self._conversation.over

    def _quiet_s(self) -> float | None:
        """Seconds without a message after which to tell the service that we are still here."""
        return self.limits.idle_timeout_s / 3 if self._conversation.linked else None

    def _tell(self, news: Iterable[News]) -> None:
        """Hand news to the caller's functions, whose own faults must not end the session."""
        for item in news:
            try:
                self._on_reconnect(item) if isinstance(item, Reconnect) else self._on_error(item)
            except Exception:
                name = "on_reconnect" if isinstance(item, Reconnect) else "on_error"
                logger.exception("%s failed for: %s", name, item)
