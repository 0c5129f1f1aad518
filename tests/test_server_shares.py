"""Whose turn it is to take the next connection."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.server.shares import EVEN, PATIENCE_S, Shares


def test_who_is_alone_is_never_ahead() -> None:
    shares = Shares(3)
    shares.tell(1, 1000)
    assert shares.fewest_of_others(1) is None
    assert not shares.is_ahead(1, 1000)


@given(st.lists(st.integers(0, 2000), min_size=2, max_size=5))
def test_the_one_with_the_fewest_is_never_ahead_and_the_first_by_far_is(counts: list[int]) -> None:
    shares = Shares(len(counts))
    for place, count in enumerate(counts):
        shares.tell(place, count)
    fewest, most = min(counts), max(counts)
    assert not shares.is_ahead(counts.index(fewest), fewest)
    assert shares.is_ahead(counts.index(most), most) == (most > fewest + fewest // EVEN)


@given(st.integers(2, 5), st.data())
def test_whoever_comes_first_all_have_about_as_many(workers: int, data: st.DataObject) -> None:
    shares, counts = Shares(workers), [0] * workers
    for place in range(workers):
        shares.tell(place, 0)
    for first in data.draw(st.lists(st.integers(0, workers - 1), max_size=300)):
        order = [(first + step) % workers for step in range(workers)]
        place = next(place for place in order if not shares.is_ahead(place, counts[place]))
        counts[place] += 1
        shares.tell(place, counts[place])
    assert max(counts) - min(counts) <= 1 + min(counts) // EVEN


def test_who_takes_none_or_is_silent_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("fervor.server.shares.monotonic", lambda: now)
    shares = Shares(3)
    shares.tell(0, 0)
    shares.tell(1, 5)
    shares.tell(2, 9)
    assert shares.fewest_of_others(2) == 0
    shares.withdraw(0)
    assert shares.fewest_of_others(2) == 5
    now += PATIENCE_S + 0.01
    assert shares.fewest_of_others(2) is None
    shares.tell(1, 5)
    assert shares.is_ahead(2, 9)


def test_a_forked_process_sees_and_is_seen() -> None:
    shares = Shares(2)
    shares.tell(0, 3)
    child = os.fork()
    if child == 0:
        shares.tell(1, shares.fewest_of_others(1) or 0)
        os._exit(0)
    os.waitpid(child, 0)
    assert shares.fewest_of_others(0) == 3
