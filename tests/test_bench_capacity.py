"""The search for the largest number of sessions."""

from hypothesis import given
from hypothesis import strategies as st

from fervor_bench.capacity import Capacity, Verdict, find_capacity


@given(st.integers(0, 5000), st.integers(0, 6000), st.sampled_from([0.01, 0.05, 0.25]))
def test_the_answer_is_as_close_as_asked(true: int, first: int, resolution: float) -> None:
    asked: list[int] = []

    def judge(sessions: int) -> Verdict:
        asked.append(sessions)
        return Verdict(keeps=sessions <= true, valid=True)

    found = find_capacity(judge, first=first, most=4000, resolution=resolution, attempts=1)
    true = min(true, 4000)
    assert found.sessions <= true <= found.sessions * (1 + resolution) + 1
    assert true < 4000 if found.bounded else found.sessions * (1 + resolution) + 1 >= 4000
    assert len(asked) <= 30
    assert all(1 <= sessions <= 4000 for sessions in asked)


def test_one_failure_of_two_is_forgiven() -> None:
    failed: set[int] = set()

    def judge(sessions: int) -> Verdict:
        first_time = sessions not in failed
        failed.add(sessions)
        return Verdict(keeps=sessions <= 100 and not first_time, valid=True)

    assert 95 <= find_capacity(judge, first=64, most=1000, resolution=0.05).sessions <= 100


def test_a_failure_that_proves_nothing_bounds_nothing() -> None:
    found = find_capacity(lambda n: Verdict(keeps=n <= 100, valid=n <= 100), first=64, most=1000, resolution=0.0)
    assert found == Capacity(100, bounded=False)


def test_the_long_trial_has_the_last_word() -> None:
    asked: list[int] = []

    def confirm(sessions: int) -> Verdict:
        asked.append(sessions)
        return Verdict(keeps=sessions <= 80, valid=True)

    found = find_capacity(lambda n: Verdict(n <= 100, valid=True), first=64, most=1000, attempts=1, confirm=confirm)
    assert 76 <= found.sessions <= 80
    assert found.bounded
    assert asked == sorted(asked, reverse=True)
    assert asked[-1] == found.sessions


def test_nothing_is_kept_where_nothing_is_confirmed() -> None:
    never = Verdict(keeps=False, valid=True)
    assert find_capacity(lambda _: Verdict(True, valid=True), first=4, most=8, confirm=lambda _: never).sessions == 0
