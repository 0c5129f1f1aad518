"""The label that is made of an analyser's guesses."""

from examples.face_labels.steady_label import GIVEN_UP, TAKEN_ON, SteadyLabel
from hypothesis import given
from hypothesis import strategies as st

JOY = {"joy": 0.9, "neutral": 0.1}
SURPRISE = {"joy": 0.1, "surprise": 0.9}


def follow(*guesses, every_s: float = 0.2) -> list[str]:
    steady = SteadyLabel()
    return [steady.update(number * every_s, guess) for number, guess in enumerate(guesses)]


def test_a_clear_face_is_believed_at_once():
    assert follow(JOY) == ["joy"]


def test_one_odd_picture_changes_nothing():
    assert set(follow(*[JOY] * 5, SURPRISE, *[JOY] * 5)) == {"joy"}


def test_another_expression_takes_over_within_a_second():
    labels = follow(*[JOY] * 5, *[SURPRISE] * 5)
    assert labels[:5] == ["joy"] * 5
    assert labels[-1] == "surprise"


def test_a_doubtful_face_has_no_label():
    assert set(follow(*[{"joy": 0.5, "fear": 0.5}] * 10)) == {"unknown"}


def test_a_share_at_the_border_does_not_flicker():
    border = (TAKEN_ON + GIVEN_UP) / 2
    wavering = [{"joy": border + 0.08 * (-1) ** n} for n in range(40)]
    assert set(follow(*wavering)) == {"unknown"}
    assert set(follow(*[JOY] * 5, *wavering)) == {"joy"}


def test_a_face_that_is_gone_loses_its_label():
    labels = follow(*[JOY] * 5, *[None] * 5)
    assert labels[5] == "joy"  # hidden for a moment
    assert labels[-1] == "unknown"
    assert follow(None, None) == ["unknown", "unknown"]


@given(st.lists(st.one_of(st.none(), st.floats(0, 1)), min_size=1), st.floats(0.01, 5.0))
def test_whatever_is_guessed_the_label_is_one_of_the_guessed_or_unknown(shares, every_s: float):
    guesses = [None if share is None else {"joy": share, "anger": 1.0 - share} for share in shares]
    assert set(follow(*guesses, every_s=every_s)) <= {"joy", "anger", "unknown"}


def test_it_goes_by_time_and_not_by_the_number_of_guesses():
    assert follow(*[JOY] * 3, SURPRISE, every_s=10.0)[-1] == "surprise"
    assert follow(*[JOY] * 30, *[SURPRISE] * 3, every_s=0.01)[-1] == "joy"
