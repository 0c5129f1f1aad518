"""Every message survives a round trip; what is misspelt is told."""

import inspect

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from fervor.protocol import messages
from fervor.protocol.codec import CODECS
from fervor.protocol.messages import ClientMessage, Estimate, Frame, ServerMessage


def variants(union) -> list[type]:
    return list(union.__origin__.__args__)


def test_every_message_class_is_in_a_union_once():
    classes = {
        cls
        for _, cls in inspect.getmembers(messages, inspect.isclass)
        if issubclass(cls, messages._Message) and "type" in cls.model_fields
    }
    assert classes == {*variants(ClientMessage), *variants(ServerMessage)}
    types = [cls.model_fields["type"].default for cls in classes]
    assert len(types) == len(set(types))


numbers = st.floats(-1, 1)
frames = st.builds(
    Frame,
    body=st.text(min_size=1, max_size=10),
    seq=st.integers(0, 2**53),
    t=st.none() | st.floats(allow_nan=False, allow_infinity=False),
    q=st.lists(st.none() | st.tuples(numbers, numbers, numbers, numbers), max_size=4).map(tuple),
    mask=st.none() | st.lists(st.booleans(), max_size=4).map(tuple),
    emotion=st.none() | st.sampled_from(["joy", "fear"]) | st.dictionaries(st.sampled_from(["joy"]), st.floats(0, 1)),
)
estimates = st.builds(
    Estimate,
    seq=st.integers(0, 2**53),
    t=st.floats(-1e9, 1e9),
    intensity=st.none() | st.floats(0, 1),
    by_emotion=st.none(),
)


@pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS.keys())
@given(frame=frames, estimate=estimates)
def test_round_trip_to_the_bit(codec, frame, estimate):
    assert codec.decode_client(codec.encode(frame)) == frame
    assert codec.decode_server(codec.encode(estimate)) == estimate


def test_fields_are_described_or_speak_for_themselves():
    schema = TypeAdapter(ClientMessage).json_schema()
    assert {cls.__name__ for cls in variants(ClientMessage)} <= set(schema["$defs"])
    assert all(definition["description"] for definition in schema["$defs"].values())
