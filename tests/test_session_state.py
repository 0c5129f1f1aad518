"""The table of transitions."""

import itertools

import pytest

from fervor.errors import CloseCode, ProtocolError
from fervor.protocol.messages import ClientMessage
from fervor.session.state import TRANSITIONS, SessionState, transition

TYPES = [variant.model_fields["type"].default for variant in ClientMessage.__origin__.__args__]


@pytest.mark.parametrize(("state", "message"), list(itertools.product(SessionState, TYPES)))
def test_what_is_not_in_the_table_is_a_fatal_protocol_error(state, message):
    if (state, message) in TRANSITIONS:
        assert transition(state, message) is TRANSITIONS[state, message]
        return
    with pytest.raises(ProtocolError, match=f"{message} came at the wrong time; expected") as caught:
        transition(state, message)
    assert caught.value.close_code is CloseCode.BAD_MESSAGE


def test_every_message_is_allowed_somewhere():
    assert {message for _, message in TRANSITIONS} == set(TYPES)
