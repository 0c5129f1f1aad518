"""A frame that comes twice gets one answer, also from another service."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fervor.emotions import EMOTIONS
from fervor.errors import CheckpointUnknown
from fervor.levels import Level
from fervor.protocol.lean_estimate import LeanEstimate
from fervor.session.answers import REMEMBERED, Answers

shares = st.floats(0, 1)


@st.composite
def lives(draw):
    """Estimates of one body; whether they have an intensity for every emotion is agreed for all."""
    by_emotion = draw(st.booleans())
    told = []
    for seq in draw(st.lists(st.integers(0, 2**53), max_size=100, unique=True)):
        intensity = draw(st.none() | shares)
        each = dict.fromkeys(EMOTIONS, draw(shares)) if by_emotion and intensity is not None else None
        told.append(
            LeanEstimate(
                body="eve",
                seq=seq,
                t=draw(st.floats(allow_nan=False, allow_infinity=False)),
                intensity=intensity,
                level=draw(st.sampled_from([None, *Level])),
                emotion=draw(st.sampled_from([*EMOTIONS, "unknown"])),
                status=draw(st.sampled_from(["warming_up", "ok", "insufficient"])),
                flags=draw(st.sampled_from([(), ("held",), ("reset", "lost"), ("between_steps", "jump")])),
                by_emotion=each,
            )
        )
    return told


@settings(suppress_health_check=[HealthCheck.too_slow])  # a hundred estimates take a second to make on a busy machine
@given(lives())
def test_what_is_kept_survives_the_way_through_bytes_to_the_bit(told):
    answers = Answers("eve")
    for estimate in told:
        answers.expect(estimate.seq)
        answers.give(estimate)
    again = Answers.from_bytes("eve", answers.to_bytes())
    assert (again.newest, again.any) == (told[-1] if told else None, bool(told))
    for place, estimate in enumerate(told):
        kept = estimate if place >= len(told) - REMEMBERED else None
        assert answers.find(estimate.seq) == again.find(estimate.seq) == kept
    assert len(again.to_bytes()) == min(len(told), REMEMBERED)


@given(st.lists(st.integers(0, 90), max_size=300), st.randoms(use_true_random=False))
def test_what_is_remembered_does_not_depend_on_how_far_the_engine_has_come(seqs, dice):
    """Answered at once or late, in one order: the same frames are known, forgotten, and shared."""
    prompt, slow = Answers("eve"), Answers("eve")
    under_way: list[int] = []

    def conclude(answers, seq):
        answers.give(LeanEstimate(body="e", seq=seq, t=0, intensity=None, level=None, emotion="joy", status="ok"))

    for seq in seqs:
        known = prompt.find(seq) is not None
        if not known:
            assert prompt.expect(seq) is False
            conclude(prompt, seq)
        if slow.find(seq) is not None:
            assert known
        else:
            shares = slow.expect(seq)
            assert shares is known
            if not shares:
                under_way.append(seq)
        while under_way and dice.random() < 0.3:
            conclude(slow, under_way.pop(0))


def test_a_failed_frame_may_come_again():
    answers = Answers("eve")
    assert [answers.expect(7), answers.expect(7)] == [False, True]
    answers.fail(7)
    assert answers.expect(7) is False


@given(st.binary(max_size=60))
def test_bytes_of_something_else_are_refused(data):
    with pytest.raises(CheckpointUnknown):
        Answers.from_bytes("eve", [data])
