"""Bodies come and go; one that flickers stays."""

from fervor_ros.roster import Roster

S = 1_000_000_000


def test_a_body_is_gone_after_its_grace() -> None:
    roster = Roster((), S)
    roster.listed(["a", "b", ""], 0)
    roster.listed(["b"], 10 * S)
    assert roster.sweep(10 * S) == frozenset()
    assert roster.bodies == {"a", "b"}
    assert roster.sweep(11 * S) == {"a"}
    assert roster.sweep(12 * S) == frozenset()
    assert roster.bodies == {"b"}


def test_one_that_flickers_stays() -> None:
    roster = Roster((), S)
    for second in range(10):
        roster.listed(["a"] if second % 2 else [], second * S // 2)
        assert roster.sweep(second * S // 2) == frozenset()
    assert roster.bodies == {"a"}


def test_being_missing_is_counted_from_the_first_list_without_it() -> None:
    roster = Roster((), S)
    roster.listed(["a"], 0)
    for tenth in range(10):
        roster.listed([], tenth * S // 10)
    assert roster.sweep(S) == {"a"}


def test_fixed_bodies_never_go() -> None:
    roster = Roster(["a"], S)
    assert roster.bodies == {"a"}
    roster.listed([], 0)
    assert roster.sweep(100 * S) == frozenset()


def test_a_clock_set_back_keeps_nobody() -> None:
    roster = Roster((), S)
    roster.listed(["a"], 100 * S)
    roster.listed([], 101 * S)
    assert roster.sweep(2 * S) == {"a"}
