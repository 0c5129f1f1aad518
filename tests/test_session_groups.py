"""Answers wait for the last of their message."""

from fervor.protocol.messages import Estimate
from fervor.session.groups import Groups


def estimate(seq: int) -> Estimate:
    return Estimate(body="0", seq=seq, t=0.0, intensity=0.5, level="weak", emotion="joy", status="ok")


def test_answers_come_together_in_the_order_of_their_frames():
    groups = Groups()
    group = groups.open()
    for _ in range(2):
        groups.expect(group)
    groups.put(group, 1, estimate(8))
    assert groups.close(group) is None
    groups.put(group, 0, estimate(7))
    assert groups.close(group) is None
    answers = groups.close(group)
    assert answers is not None
    assert [answer.seq for answer in answers] == [7, 8]


def test_a_message_without_frames_under_way_ends_at_once():
    groups = Groups()
    assert groups.close(groups.open()) == ()


def test_messages_do_not_mix():
    groups = Groups()
    first, second = groups.open(), groups.open()
    groups.put(second, 0, estimate(1))
    assert groups.close(first) == ()
    assert groups.close(second) == (estimate(1),)
