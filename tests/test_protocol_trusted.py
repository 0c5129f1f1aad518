"""A trusted message can't be told from one that was validated, and is encoded to the same bytes."""

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.levels import Level
from fervor.protocol.codec import CODECS, JsonCodec, MsgpackCodec
from fervor.protocol.messages import Estimate, Estimates
from fervor.protocol.trusted import trusted

shares = st.floats(0, 1)
fields = st.fixed_dictionaries(
    {
        "type": st.just("estimate"),
        "body": st.text(min_size=1, max_size=8),
        "seq": st.integers(0, 2**53),
        "t": st.floats(allow_nan=False, allow_infinity=False),
        "intensity": shares | st.none(),
        "level": st.sampled_from([*Level, None]),
        "emotion": st.sampled_from(["joy", "unknown"]),
        "status": st.sampled_from(["ok", "warming_up", "insufficient"]),
        "flags": st.sampled_from([(), ("late",), ("gap_reset", "jump")]),
        "by_emotion": st.dictionaries(st.sampled_from(["joy", "anger"]), shares) | st.none(),
    }
).map(lambda values: {name: values[name] for name in Estimate.model_fields})


@given(values=fields)
def test_it_is_the_validated_one(values) -> None:
    plain, quick = Estimate(**values), trusted(Estimate, dict(values))
    assert quick == plain
    assert repr(quick) == repr(plain)
    assert quick.model_copy(update={"flags": ("duplicate",)}) == plain.model_copy(update={"flags": ("duplicate",)})


@given(values=st.lists(fields, min_size=1, max_size=3))
def test_its_bytes_are_those_that_pydantic_writes(values) -> None:
    plain = Estimates(estimates=tuple(Estimate(**each) for each in values))
    quick = Estimates(estimates=tuple(trusted(Estimate, dict(each)) for each in values))
    packed, text = CODECS[MsgpackCodec.subprotocol], CODECS[JsonCodec.subprotocol]
    for message, other in ((quick, plain), (quick.estimates[0], plain.estimates[0])):
        assert packed.encode(message) == msgpack.packb(other.model_dump())
        assert text.encode(message) == other.model_dump_json()


def test_it_can_not_be_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        trusted(Estimates, {"type": "estimates", "estimates": ()}).estimates = ()
