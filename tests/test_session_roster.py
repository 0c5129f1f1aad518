"""Who is there, and whose slot the next one takes."""

import itertools
import math

import numpy as np
import pytest

from bodies import motion, terms
from fervor.errors import FrameError, InputError
from fervor.session.events import Pose, Release
from fervor.session.label import NO_LABEL
from fervor.session.roster import Roster


def roster(*, most=3, idle_s=10.0) -> Roster:
    return Roster(itertools.count().__next__, most=most, idle_s=idle_s)


def see(people: Roster, name: str, time: float):
    body = people.seen(name, time, terms(), lambda: NO_LABEL)
    body.plan(body.newest_seq + 1, time, Pose(motion(1)[0], np.ones(13, np.bool_)))
    return body


def test_a_body_stays_the_same_while_it_is_seen():
    people = roster()
    first = see(people, "a", 0.0)
    assert see(people, "a", 9.0) is first
    assert people.find("a", 9.0) is people.known("a") is first
    assert people.find("a", 20.0) is None
    assert [body.name for body in people] == ["a"]


def test_a_forgotten_bodys_slot_goes_to_the_next_new_one_the_rest_is_released():
    people = roster()
    see(people, "a", 0.0)
    see(people, "b", 0.0)
    assert see(people, "c", 20.0).slot in {0, 1}
    assert [body.name for body in people] == ["c"]
    (rest,) = people.give_up_spare()
    assert rest.slot in {0, 1}
    assert people.give_up_spare() == []


def test_who_returns_after_long_is_a_new_body_that_says_so():
    people = roster()
    first = see(people, "a", 0.0)
    again = people.seen("a", 30.0, terms(), lambda: NO_LABEL)
    assert again is not first
    assert again.plan(0, 30.0, Pose(motion(1)[0], np.ones(13, np.bool_))).flags == ("gap_reset",)


def test_nobody_is_forgotten_where_times_mean_nothing():
    people = roster(idle_s=math.inf)
    first = see(people, "a", 0.0)
    assert see(people, "a", 1e9) is first


def test_one_too_many():
    people = roster(most=1)
    see(people, "a", 0.0)
    with pytest.raises(InputError, match="body 'b' is one too many; this service takes 1 a session"):
        see(people, "b", 1.0)


def test_the_end():
    people = roster()
    see(people, "a", 0.0)
    see(people, "b", 0.0)
    assert people.end("a") == Release(0)
    with pytest.raises(FrameError, match="'a' is not known"):
        people.end("a")
    assert people.clear() == [Release(1)]
    assert list(people) == []
