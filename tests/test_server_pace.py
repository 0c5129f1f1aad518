"""The allowance of frames refills with time."""

import pytest

from fervor.errors import RateExceeded
from fervor.server.pace import Pace


def test_a_second_may_come_at_once() -> None:
    pace = Pace(100.0, burst=10)
    pace.take(100, now=5.0)
    with pytest.raises(RateExceeded, match="more than 100 frames a second came") as raised:
        pace.take(1, now=5.0)
    assert raised.value.retry_after == 1.0


def test_it_refills_with_time() -> None:
    pace = Pace(100.0, burst=10)
    pace.take(100, now=5.0)
    pace.take(49, now=5.5)
    with pytest.raises(RateExceeded):
        pace.take(2, now=5.5)


def test_it_never_holds_more_than_a_second() -> None:
    pace = Pace(100.0, burst=10)
    pace.take(0, now=0.0)
    with pytest.raises(RateExceeded):
        pace.take(101, now=1000.0)


def test_a_whole_message_always_fits() -> None:
    Pace(10.0, burst=1024).take(1024, now=0.0)


def test_a_steady_sensor_is_never_refused() -> None:
    pace = Pace(30.0, burst=1)
    for frame in range(10_000):
        pace.take(1, now=frame / 30.0)
