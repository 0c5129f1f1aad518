"""Only tokens of our own keys are taken, whole and in time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.errors import CheckpointUnknown, CloseCode
from fervor.session.sealing import Sealer

OLD, NEW = b"old key", b"new key"
SEALER = Sealer((NEW, OLD), ttl_s=60.0)


@given(st.binary(max_size=200), st.floats(0, 2e9))
def test_round_trip(content, now):
    assert SEALER.open(SEALER.seal(content, now), now + 59) == content


def test_keys_rotate_without_losing_a_stream():
    token = Sealer((OLD,), 60.0).seal(b"x", 0.0)
    assert SEALER.open(token, 1.0) == b"x"
    with pytest.raises(CheckpointUnknown, match="not signed with a key of this service") as caught:
        Sealer((NEW,), 60.0).open(token, 1.0)
    assert caught.value.close_code is CloseCode.CHECKPOINT_UNKNOWN


def test_too_old():
    with pytest.raises(CheckpointUnknown, match="61 s old; it was good for 60 s"):
        SEALER.open(SEALER.seal(b"x", 0.0), 61.0)


@given(st.data())
def test_one_altered_character_is_enough(data):
    token = SEALER.seal(b"some content", 5.0)
    place = data.draw(st.integers(0, len(token.rstrip("=")) - 2))  # the last one may hold unused bits
    letter = data.draw(st.sampled_from("AZaz09-_").filter(lambda other: other != token[place]))
    with pytest.raises(CheckpointUnknown):
        SEALER.open(token[:place] + letter + token[place + 1 :], 6.0)


@given(st.text(max_size=300))
def test_no_text_raises_anything_else(text):
    with pytest.raises(CheckpointUnknown):
        SEALER.open(text, 0.0)
