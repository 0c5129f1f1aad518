"""What the async and the sync session share: all that needs no waiting."""

import logging
from collections.abc import Callable

from fervor.errors import FervorError
from fervor.protocol.messages import Limits, ModelInfo, SessionStarted
from fervor_client.conversation import Conversation

logger = logging.getLogger("fervor_client")

WINDOW = 256
"""Most frames under way: eight seconds of a 30 Hz sensor. Then sending waits for answers."""

CLOSE_TIMEOUT_S = 2.0
"""Longest wait for the other side when closing."""

OnError = Callable[[FervorError], None]


def log_error(error: FervorError) -> None:
    """What happens to a recoverable error that nobody awaits, unless `connect` is told otherwise."""
    logger.warning("%s", error)


class BaseSession:
    """The facts of a session."""

    def __init__(self, conversation: Conversation, *, window: int, on_error: OnError) -> None:
        self._conversation = conversation
        self._window = window
        self._on_error = on_error

    @property
    def started(self) -> SessionStarted:
        """What the service said at the start: session id, model, limits, joints, fingerprint."""
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

    def _has_room(self) -> bool:
        """Whether a frame can be sent, or fails, without waiting."""
        return self._conversation.in_flight < self._window or self._conversation.over

    def _quiet_s(self) -> float | None:
        """Seconds without a message after which to tell the service that we are still here."""
        started = self._conversation.started
        return started.limits.idle_timeout_s / 3 if started else None

    def _tell(self, error: FervorError) -> None:
        """Hand an error to the caller's function, whose own faults must not end the session."""
        try:
            self._on_error(error)
        except Exception:
            logger.exception("on_error failed for: %s", error)
