"""Where a conversation stands, and why it ended.

NEW ──start──▶ STARTING ──session.started──▶ OPEN ──end──▶ ENDING ──session.ended──▶ CLOSED
└──────── fatal error, connection lost for good, from any state ─────▲
"""

from enum import Enum, auto

from fervor.errors import FervorError, Unreachable
from fervor.protocol.messages import Totals


class State(Enum):
    """Where a conversation stands."""

    NEW = auto()
    STARTING = auto()
    OPEN = auto()
    ENDING = auto()
    CLOSED = auto()


class Standing:
    """The state of one conversation."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.state = State.NEW
        self.failure: FervorError | None = None
        """Why the conversation ended, unless both sides wanted it to."""
        self.totals: Totals | None = None
        """What the session came to, once it has ended."""

    @property
    def over(self) -> bool:
        """Whether nothing more will come."""
        return self.state is State.CLOSED

    def lost(self, failure: FervorError | None) -> None:
        """The conversation is over; `failure` says why, None that it was meant to be."""
        if not self.over:
            self.state, self.failure = State.CLOSED, failure

    def must_be_open(self) -> None:
        """Raise why nothing can be sent, unless something can."""
        if self.state is State.OPEN:
            return
        if self.failure is not None:
            raise self.failure
        what = "has not started" if self.state in (State.NEW, State.STARTING) else "has ended; connect again"
        raise Unreachable(f"the session with {self.url} {what}")

    def ended(self, totals: Totals) -> None:
        """Both sides are done."""
        self.totals, self.state = totals, State.CLOSED
