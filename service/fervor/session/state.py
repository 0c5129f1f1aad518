"""The states of a session, and which message is allowed in which: the table is the rule, nothing else decides.

    session.start            session.end            last estimate sent
NEW ─────────────▶ OPEN ────────────────▶ ENDING ─────────────────▶ CLOSED
 └──────────────── a fatal error, from any state ────────────────────▲
"""

from collections.abc import Mapping
from enum import IntEnum, auto

from fervor.errors import ProtocolError


class SessionState(IntEnum):
    """Where a conversation stands."""

    NEW = auto()
    OPEN = auto()
    ENDING = auto()
    CLOSED = auto()


TRANSITIONS: Mapping[tuple[SessionState, str], SessionState] = {
    (SessionState.NEW, "session.start"): SessionState.OPEN,
    (SessionState.NEW, "ping"): SessionState.NEW,
    (SessionState.OPEN, "frame"): SessionState.OPEN,
    (SessionState.OPEN, "frames"): SessionState.OPEN,
    (SessionState.OPEN, "body.reset"): SessionState.OPEN,
    (SessionState.OPEN, "body.end"): SessionState.OPEN,
    (SessionState.OPEN, "session.calibrate"): SessionState.OPEN,
    (SessionState.OPEN, "ping"): SessionState.OPEN,
    (SessionState.OPEN, "session.end"): SessionState.ENDING,
}
"""State and message type to the next state; what is not here is a protocol error."""

_EXPECTED: Mapping[SessionState, str] = {
    SessionState.NEW: "session.start first",
    SessionState.OPEN: "frames; a session starts once",
    SessionState.ENDING: "nothing after session.end",
    SessionState.CLOSED: "nothing after the session's end",
}


def transition(state: SessionState, message_type: str) -> SessionState:
    """The state after a client's message.

    Raises:
        ProtocolError: the message is not allowed in this state.
    """
    following = TRANSITIONS.get((state, message_type))
    if following is None:
        raise ProtocolError(f"{message_type} came at the wrong time; expected {_EXPECTED[state]}")
    return following
