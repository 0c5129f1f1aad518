"""How long it still takes."""

import pytest

from fervor_export.pace import Pace, said


def test_the_rest_takes_as_long_as_what_was_done():
    pace = Pace(trainings=3, epochs=10)
    assert pace.left_s(5.0) is None
    for number in (1, 2):
        pace.epoch(number)
    assert (pace.done, pace.total) == (2, 30)
    assert pace.left_s(8.0) == pytest.approx(28 * 4.0)


def test_what_was_done_before_is_no_work():
    pace = Pace(trainings=2, epochs=10)
    pace.begin(1)
    pace.epoch(7)  # gone on with
    assert pace.done == 17
    assert pace.left_s(2.0) == pytest.approx(3 * 2.0)
    early = Pace(trainings=2, epochs=10)
    early.epoch(1)
    early.begin(1)  # patience ended the first
    assert early.left_s(3.0) == pytest.approx(10 * 3.0)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.4, "about 5 s"),
        (43, "about 45 s"),
        (100, "about 2 min"),
        (3540, "about 59 min"),
        (3600, "about 1 h"),
        (12_000, "about 3 h 20 min"),
    ],
)
def test_durations_are_said_as_people_say_them(seconds, words):
    assert said(seconds) == words
