"""Answers leave in the order in which the frames came, whatever the order of the outcomes."""

from hypothesis import given
from hypothesis import strategies as st

from bodies import motion, terms
from fervor.errors import EngineError
from fervor.session.body import Body
from fervor.session.events import Pose
from fervor.session.under_way import UnderWay


def planned(count):
    body = Body("eve", 0, terms())
    return body, [body.plan(seq, seq / 30, Pose(motion(1)[0], motion(1)[0][:, 3] > -2)) for seq in range(count)]


@given(order=st.permutations(range(6)))
def test_outcomes_wait_for_those_of_earlier_tickets(order):
    body, tickets = planned(6)
    under_way, left, come = UnderWay(), [], set()
    for place, ticket in enumerate(tickets):
        under_way.add(ticket, body, place)
    for number in order:
        error = EngineError(str(number))
        come.add(number)
        for concluded in under_way.conclude(tickets[number], error):
            assert concluded.ticket is tickets[concluded.place]
            assert concluded.outcome.message == str(concluded.place)
            assert concluded.body is body
            left.append(concluded.place)
        assert set(range(len(left))) <= come
        assert len(left) not in come
    assert left == [0, 1, 2, 3, 4, 5]
    assert not under_way.tickets


def test_the_outcomes_of_a_session_that_is_over_are_nobodys():
    body, (ticket,) = planned(1)
    under_way = UnderWay()
    under_way.add(ticket, body)
    assert under_way.tickets
    under_way.clear()
    assert not under_way.tickets
    assert under_way.conclude(ticket, EngineError("late")) == []
