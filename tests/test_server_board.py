"""The memory that workers share."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.server.board import HALF_BYTES, Board


def test_nothing_stands_on_a_new_board() -> None:
    board = Board(3)
    assert [board.read(place) for place in range(3)] == [None, None, None]
    assert not board.stopping


@given(st.lists(st.tuples(st.integers(0, 2), st.binary(max_size=400)), max_size=20))
def test_each_place_shows_what_was_put_there_last(shown: list[tuple[int, bytes]]) -> None:
    board, last = Board(3), {}
    for place, content in shown:
        board.show(place, content)
        last[place] = content
    assert {place: board.read(place) for place in range(3)} == {place: last.get(place) for place in range(3)}


def test_a_place_that_is_cleared_shows_nothing() -> None:
    board = Board(2)
    board.show(0, b"one")
    board.show(1, b"two")
    board.clear(0)
    assert (board.read(0), board.read(1)) == (None, b"two")


def test_what_is_too_large_changes_nothing() -> None:
    board = Board(1)
    board.show(0, b"fits")
    board.show(0, bytes(HALF_BYTES))
    assert board.read(0) == b"fits"


def test_a_place_ages_until_something_is_shown_there(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("fervor.server.board.monotonic", lambda: now)
    board = Board(2)
    board.show(1, b"one")
    now = 1004.0
    assert board.age(1) == 4.0
    board.show(1, bytes(HALF_BYTES))  # too large to be shown, but a sign of life
    assert (board.age(1), board.read(1)) == (0.0, b"one")
    assert board.age(0) == now


def test_a_forked_process_sees_and_is_seen() -> None:
    board = Board(2)
    child = os.fork()
    if child == 0:
        board.show(1, b"from the other side")
        board.stop()
        os._exit(0)
    os.waitpid(child, 0)
    assert board.read(1) == b"from the other side"
    assert board.stopping
