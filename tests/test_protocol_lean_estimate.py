"""Lean estimates are, on the wire and for who reads it, those of the protocol."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.emotions import EMOTIONS
from fervor.levels import Level
from fervor.protocol.codec import CODECS
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.messages import Estimate, Estimates

SHARE = st.floats(0.0, 1.0)
LEAN = st.builds(
    LeanEstimate,
    body=st.text(min_size=1, max_size=64).filter(str.isprintable),
    seq=st.integers(0, 2**53),
    t=st.floats(allow_nan=False, allow_infinity=False),
    intensity=st.none() | SHARE,
    level=st.sampled_from([None, *Level]),
    emotion=st.sampled_from([*EMOTIONS, "unknown"]),
    status=st.sampled_from(["warming_up", "ok", "insufficient"]),
    flags=st.sampled_from([(), ("held",), ("reset", "lost"), ("between_steps", "jump")]),
    by_emotion=st.none() | st.builds(dict.fromkeys, st.just(EMOTIONS), SHARE),
)


def test_fields_are_those_of_the_message():
    assert ("type", *LeanEstimate.__struct_fields__) == tuple(Estimate.model_fields)
    assert ("type", *LeanEstimates.__struct_fields__) == tuple(Estimates.model_fields)


@pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS)
@given(lean=LEAN)
def test_an_estimate_is_read_as_the_message_that_it_stands_for(codec, lean):
    message = lean.to_message()
    assert message == Estimate(**{name: getattr(lean, name) for name in LeanEstimate.__struct_fields__})
    assert codec.decode_server(codec.encode(lean)) == message == codec.decode_server(codec.encode(message))


@pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS)
@given(leans=st.lists(LEAN, min_size=1, max_size=4))
def test_so_are_several(codec, leans):
    several = LeanEstimates(tuple(leans))
    assert several.to_message() == Estimates(estimates=tuple(lean.to_message() for lean in leans))
    assert codec.decode_server(codec.encode(several)) == several.to_message()
