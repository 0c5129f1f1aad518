"""The search for the largest number of sessions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor_bench.capacity import Capacity, Verdict, find_capacity

KEPT = Verdict(keeps=True, valid=True)
NEAR = Verdict(keeps=False, valid=True, near=True)
FAR = Verdict(keeps=False, valid=True)
UNSOUND = Verdict(keeps=False, valid=False)


class Asked:
    """A judge that keeps what it was asked."""

    def __init__(self, judge) -> None:
        self.numbers: list[int] = []
        self._judge = judge

    def __call__(self, sessions: int) -> Verdict:
        self.numbers.append(sessions)
        return self._judge(sessions)


@given(st.integers(0, 5000), st.integers(0, 6000), st.sampled_from([0.01, 0.05, 0.25]))
def test_the_answer_is_as_close_as_asked(true: int, first: int, resolution: float) -> None:
    judge = Asked(lambda sessions: KEPT if sessions <= true else FAR)
    found = find_capacity(judge, first=first, most=4000, resolution=resolution)
    true = min(true, 4000)
    assert found.sessions <= true <= found.sessions * (1 + resolution) + 1
    assert true < 4000 if found.bounded else found.sessions * (1 + resolution) + 1 >= 4000
    assert len(judge.numbers) == len(set(judge.numbers)) <= 20
    assert all(1 <= sessions <= 4000 for sessions in judge.numbers)


@given(st.integers(100, 3000), st.floats(0.65, 1.5))
def test_few_trials_are_enough_near_a_good_guess(true: int, error: float) -> None:
    judge = Asked(lambda sessions: KEPT if sessions <= true else FAR)
    find_capacity(judge, first=int(true * error), most=10_000)
    assert len(judge.numbers) <= 7


@given(st.integers(1, 3000), st.integers(0, 6000), st.data())
def test_noise_costs_no_more_than_it_hides(true: int, first: int, data: st.DataObject) -> None:
    """Near the true number anything may be answered; the rest is as it would be without noise."""

    def judge(sessions: int) -> Verdict:
        if 0.9 * true < sessions <= 1.1 * true:
            return data.draw(st.sampled_from([KEPT, NEAR, UNSOUND, FAR]))
        return KEPT if sessions <= true else FAR

    asked = Asked(judge)
    found = find_capacity(asked, first=first, most=4000)
    assert 0.9 * true / 1.05 - 1 <= found.sessions <= 1.1 * true
    assert len(asked.numbers) <= 40


@pytest.mark.parametrize("failure", [NEAR, UNSOUND])
def test_a_failure_that_was_near_or_proves_nothing_is_tried_again(failure: Verdict) -> None:
    failed: set[int] = set()

    def judge(sessions: int) -> Verdict:
        first_time = sessions not in failed
        failed.add(sessions)
        return KEPT if sessions <= 100 and not first_time else failure

    assert 95 <= find_capacity(judge, first=64, most=1000, resolution=0.05).sessions <= 100


def test_a_clear_failure_is_not_tried_again() -> None:
    judge = Asked(lambda sessions: KEPT if sessions <= 100 else FAR)
    find_capacity(judge, first=64, most=1000, attempts=5)
    assert len(judge.numbers) == len(set(judge.numbers))


def test_a_failure_that_proves_nothing_bounds_nothing() -> None:
    found = find_capacity(lambda n: KEPT if n <= 100 else UNSOUND, first=64, most=1000, resolution=0.0)
    assert found == Capacity(100, bounded=False)


@pytest.mark.parametrize(("verdict", "answer"), [(KEPT, 5000), (FAR, 0), (UNSOUND, 0)])
def test_who_keeps_all_or_nothing_is_known_soon(verdict: Verdict, answer: int) -> None:
    judge = Asked(lambda _: verdict)
    found = find_capacity(judge, first=50, most=5000, attempts=1)
    assert found == Capacity(answer, bounded=verdict is FAR)
    assert len(judge.numbers) <= 8


def test_the_long_trial_has_the_last_word() -> None:
    confirm = Asked(lambda sessions: KEPT if sessions <= 80 else NEAR)
    found = find_capacity(lambda n: KEPT if n <= 100 else FAR, first=64, most=1000, confirm=confirm)
    assert 72 <= found.sessions <= 80
    assert found.bounded
    assert len(confirm.numbers) == len(set(confirm.numbers)) <= 7  # one long trial a number, however near
    assert found.sessions in confirm.numbers


@given(st.integers(1, 3000), st.floats(0.3, 1.2))
def test_long_trials_find_their_own_number(true: int, share: float) -> None:
    """What short trials keep and long ones do not costs a few long ones, however far it is off."""
    longer = int(true * share)
    confirm = Asked(lambda sessions: KEPT if sessions <= longer else FAR)
    found = find_capacity(lambda n: KEPT if n <= true else FAR, first=true, most=4000, confirm=confirm)
    assert found.sessions <= min(longer, true) <= found.sessions * 1.1 + 1
    assert len(confirm.numbers) <= 13


def test_a_long_trial_that_proves_nothing_is_tried_again() -> None:
    verdicts = iter([UNSOUND, KEPT])
    confirm = Asked(lambda _: next(verdicts))
    found = find_capacity(lambda n: KEPT if n <= 100 else FAR, first=100, most=1000, confirm=confirm)
    assert confirm.numbers == [found.sessions, found.sessions]
    assert found.bounded


def test_nothing_is_kept_where_nothing_is_confirmed() -> None:
    assert find_capacity(lambda _: KEPT, first=4, most=8, confirm=lambda _: FAR).sessions == 0


def test_the_first_number_is_taken_as_it_is() -> None:
    judge = Asked(lambda sessions: KEPT if sessions <= 500 else FAR)
    find_capacity(judge, first=450, most=8000)
    assert judge.numbers[:2] == [450, 562]
