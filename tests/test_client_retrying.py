import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.errors import (
    AuthError,
    CheckpointUnknown,
    EngineError,
    FervorError,
    IdleTimeout,
    InputError,
    Overloaded,
    ProtocolError,
    RateExceeded,
    TooLarge,
    Unreachable,
)
from fervor_client.retrying import LONGEST_PAUSE_S, MOST_FAULTS, STABLE_S, Pace, Retries, worth_retrying


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def retries(retry_for: float | None = 60.0, dice: float = 1.0) -> tuple[Retries, Clock]:
    clock = Clock()
    return Retries(retry_for, now=clock, dice=lambda: dice), clock


@pytest.mark.parametrize(
    ("error", "worth"),
    [
        (Unreachable("1001, 1006, 1011, 1012, refused, cut"), True),
        (Overloaded("1013, 503"), True),
        (IdleTimeout("4408"), True),
        (FervorError("internal"), True),
        (ProtocolError("4400"), False),
        (AuthError("4401"), False),
        (CheckpointUnknown("4404"), False),
        (RateExceeded("4429"), False),
        (TooLarge("1009"), False),
        (InputError("no stream there"), False),
        (EngineError("recoverable"), False),
    ],
)
def test_what_another_try_may_cure_is_worth_it(error: FervorError, worth: bool) -> None:
    assert worth_retrying(error) is worth


def test_pauses_double_up_to_the_longest() -> None:
    tries, _ = retries()
    assert [tries.failed(Unreachable("x")) for _ in range(9)] == [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0]


@given(st.floats(0.0, 1.0, exclude_max=True), st.integers(1, 200))
def test_a_pause_is_a_random_part_of_that(dice: float, attempts: int) -> None:
    tries, _ = retries(None, dice)
    pauses = [tries.failed(Unreachable("x")) for _ in range(attempts)]
    assert all(pause is not None and 0.0 <= pause <= LONGEST_PAUSE_S for pause in pauses)


def test_a_service_that_says_when_is_not_asked_earlier() -> None:
    tries, _ = retries(dice=0.5)
    assert tries.failed(Overloaded("full", retry_after=7.0)) == 7.05


def test_the_last_attempt_is_made_when_the_time_is_up() -> None:
    tries, clock = retries(3.0)
    assert tries.failed(Overloaded("full", retry_after=10.0)) == 3.0
    clock.now += 3.0
    assert tries.failed(Overloaded("still full")) is None
    assert str(tries.surrender()) == "full; tried to reconnect once in 3 s, the last time: still full"


def test_what_is_not_worth_it_ends_it_as_it_is() -> None:
    tries, clock = retries()
    assert tries.failed(RateExceeded("too fast")) is None
    assert str(tries.surrender()) == "too fast"
    tries, clock = retries()
    tries.failed(Unreachable("gone"))
    clock.now += 2.0
    assert tries.failed(AuthError("wants a token")) is None
    error = tries.surrender()
    assert isinstance(error, AuthError)
    assert str(error) == "gone; tried to reconnect once in 2 s, the last time: wants a token"


def test_what_the_next_attempt_leaves_out_is_tried_again() -> None:
    tries, _ = retries()
    assert tries.failed(CheckpointUnknown("too old"), curable=True) == 0.1


def test_an_answer_ends_an_outage_and_so_does_a_connection_that_holds() -> None:
    tries, clock = retries(10.0)
    for prove in (tries.answered, lambda: setattr(clock, "now", clock.now + STABLE_S)):
        for _ in range(4):
            tries.failed(Unreachable("x"))
        tries.connected()
        prove()
        assert tries.failed(Unreachable("x")) == 0.1
        assert tries.seconds == 0.0


def test_a_connection_that_is_lost_at_once_is_the_same_outage() -> None:
    tries, clock = retries(10.0)
    for _ in range(3):
        tries.failed(Unreachable("x"))
        tries.connected()
        clock.now += 4.0
    assert tries.failed(Unreachable("x")) is None


def test_a_fault_that_this_stream_may_cause_is_not_caused_for_ever() -> None:
    tries, _ = retries(None)
    pauses = [tries.failed(FervorError("the fault is its own")) for _ in range(MOST_FAULTS + 1)]
    assert pauses[-1] is None
    assert None not in pauses[:-1]


def test_a_backlog_leaves_below_the_rate_of_the_service() -> None:
    clock = Clock()
    pace = Pace(100.0, clock)
    begin, left = clock.now, 0
    while clock.now < begin + 10.0:
        clock.now += pace.wait_s()
        pace.take()
        left += 1
        assert left <= 100.0 + (clock.now - begin) * 100.0
    assert left > 900
