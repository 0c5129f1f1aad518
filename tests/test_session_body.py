"""A body's frames become tickets, its outcomes estimates."""

import msgspec
import numpy as np
import pytest

from bodies import motion, terms
from fervor.errors import InputError
from fervor.levels import Level
from fervor.session.answers import REMEMBERED
from fervor.session.body import Body
from fervor.session.events import Outcome, Pose

ALL = np.ones(13, np.bool_)


def pose(observed=ALL) -> Pose:
    return Pose(motion(1)[0], observed)


def outcome(intensity=0.3, seen=9, jumped=0) -> Outcome:
    return Outcome(intensity, np.linspace(0, 1, 11), seen, jumped)


def answer(body, seq, time, *, observed=ALL, emotion=None, **result):
    ticket = body.plan(seq, time, pose(observed), emotion=emotion)
    return body.conclude(ticket, outcome(**result))


def test_warming_up_for_a_second_then_ok():
    body = Body("eve", 3, terms())
    status = [answer(body, k, k / 30).status for k in range(40)]
    assert status[:30] == ["warming_up"] * 30
    assert set(status[30:]) == {"ok"}


def test_the_first_ticket_is_fresh_the_second_is_not():
    body = Body("eve", 3, terms())
    first, second = body.plan(0, 0.0, pose()), body.plan(1, 1 / 30, pose())
    assert (first.fresh, second.fresh) == (True, False)
    assert (first.slot, first.body) == (3, "eve")
    assert len(first.steps) == len(second.steps) == 1


def test_reset_starts_anew_and_says_so_once():
    body = Body("eve", 0, terms())
    for k in range(60):
        answer(body, k, k / 30)
    body.reset()
    again = body.plan(60, 2.0, pose())
    assert again.fresh
    assert again.flags == ("reset",)
    estimate = body.conclude(again, outcome())
    assert estimate.status == "warming_up"
    assert answer(body, 61, 2.04).flags == ()


def test_a_lost_body_keeps_its_last_intensity_and_is_insufficient():
    body = Body("eve", 0, terms())
    for k in range(60):
        answer(body, k, k / 30)
    estimate = answer(body, 60, 2.0, observed=~ALL, intensity=0.42)
    assert (estimate.status, estimate.flags, estimate.intensity) == ("insufficient", ("lost",), 0.42)
    ticket = body.plan(61, 2.1, pose())
    assert ticket.flags == ("interpolated",)  # the gap counts from the last pose, not from the empty frame


def test_too_few_joints_are_insufficient_relative_to_what_the_sensor_sees():
    body = Body("eve", 0, terms())
    assert answer(body, 0, 0.0, seen=5).status == "insufficient"
    assert answer(body, 1, 0.03, seen=6).status == "warming_up"


def test_no_intensity_is_null_not_zero():
    estimate = answer(Body("eve", 0, terms()), 0, 0.0, observed=~ALL, intensity=None)
    assert (estimate.intensity, estimate.level) == (None, None)


def test_late_frames_bring_no_work_and_say_so():
    body = Body("eve", 0, terms())
    answer(body, 5, 1.0)
    for seq, time in ((4, 1.1), (6, 0.9), (7, 1.0)):
        ticket = body.plan(seq, time, pose())
        assert (ticket.steps, ticket.pose, ticket.flags) == ((), None, ("late",))


def test_a_frame_that_was_to_share_a_failed_answer_gets_or_fails_its_own():
    for fails in (False, True):
        body = Body("eve", 0, terms())
        first, again = (body.plan(0, 0.0, pose()) for _ in range(2))
        body.fail(first)
        if fails:
            body.fail(again)
        else:
            assert body.conclude(again, outcome()).flags == ("duplicate",)
        assert body.in_flight == 0
        assert answer(body, 1, 0.1).flags == ("reset",)


def test_duplicates_get_the_same_answer_flagged():
    body = Body("eve", 0, terms())
    first = answer(body, 0, 0.0, intensity=0.7)
    again = body.answered(0)
    assert again == msgspec.structs.replace(first, flags=("duplicate",))
    for seq in range(1, REMEMBERED + 1):
        answer(body, seq, seq / 30)
    assert body.answered(0) is None


def test_labels_change_at_any_frame_and_expire():
    body = Body("eve", 0, terms())
    assert answer(body, 0, 0.0).emotion == "unknown"
    assert answer(body, 1, 0.04, emotion="joy").emotion == "joy"
    assert answer(body, 2, 0.07).emotion == "joy"
    assert answer(body, 3, 0.10, emotion={"fear": 0.9}).emotion == "fear"
    assert answer(body, 4, 0.9).emotion == "fear"
    assert answer(body, 5, 1.8).emotion == "fear"
    assert answer(body, 6, 2.2).emotion == "unknown"


def test_a_bad_label_leaves_no_trace():
    body = Body("eve", 0, terms())
    with pytest.raises(InputError, match="'joie' is not known"):
        body.plan(0, 0.0, pose(), emotion="joie")
    assert answer(body, 0, 0.0).flags == ()


def test_levels_follow_the_models_thresholds():
    body = Body("eve", 0, terms())
    limit = terms().metadata.levels.threshold["joy"]
    assert answer(body, 0, 0.0, emotion="joy", intensity=limit - 0.01).level is Level.WEAK
    assert answer(body, 1, 0.5, intensity=1.0).level is Level.WEAK
    assert answer(body, 2, 1.1, intensity=1.0).level is Level.STRONG


def test_by_emotion_only_where_asked():
    assert answer(Body("eve", 0, terms()), 0, 0.0).by_emotion is None
    table = answer(Body("eve", 0, terms(by_emotion=True)), 0, 0.0).by_emotion
    assert table is not None
    assert list(table)[:2] == ["amusement", "anger"]


def test_jumps_are_flagged():
    assert "jump" in answer(Body("eve", 0, terms()), 0, 0.0, jumped=1).flags


def test_clock_frames_needs_no_sane_times():
    body = Body("eve", 0, terms(clock="frames"))
    tickets = [body.plan(seq, time, pose()) for seq, time in enumerate((0.0, 100.0, 50.0))]
    assert [len(ticket.steps) for ticket in tickets] == [1, 1, 1]
