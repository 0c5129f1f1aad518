"""Admission: who may open one more session, decided before the upgrade."""

from fervor.engine.slots import Slots
from fervor.errors import Overloaded
from fervor.server.draining import Drain
from fervor.server.metrics import Metrics
from fervor.server.shedding import Shedding
from fervor.settings import Settings

COME_BACK_S = 1.0
"""What a client that found the service full is told to wait, seconds."""


class Sessions:
    """The WebSocket sessions that are open."""

    def __init__(self, settings: Settings, *, slots: Slots, drain: Drain, shedding: Shedding, metrics: Metrics) -> None:
        self.open = 0
        self._settings = settings
        self._slots = slots
        self._drain = drain
        self._shedding = shedding
        self._metrics = metrics

    @property
    def full(self) -> bool:
        """Whether one more would be refused."""
        return self._refusal() is not None

    def admit(self) -> None:
        """Make room for one more session; `leave` frees it.

        Raises:
            Overloaded: the service stops, is late with its frames, has as many sessions as it takes, or no body left to
                follow.
        """
        refusal = self._refusal()
        if refusal is not None:
            reason, sentence = refusal
            self._metrics.note_refusal(reason)
            raise Overloaded(sentence, retry_after=COME_BACK_S)
        self.open += 1

    def leave(self) -> None:
        """A session is over that was admitted."""
        self.open -= 1

    def _refusal(self) -> tuple[str, str] | None:
        """Why not, for programs and for people."""
        if self._drain.started:
            return "draining", "this service is on its way out; connect again"
        if self.open >= self._settings.max_sessions:
            return "sessions", f"all {self.open} sessions of this service are open"
        if self._slots.taken >= self._slots.capacity:
            return "bodies", f"all {self._settings.capacity} bodies of this service are in use"
        if self._shedding.overloaded:
            return "delay", "this service is late with the frames of those it has"
        return None
