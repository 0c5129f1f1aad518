"""Labels from whatever way a table writes its observers' answers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fervor.emotions import EMOTIONS
from fervor.errors import DataError
from fervor_export.data.label import Label, count_answers, label_from_responses, label_from_votes

ANSWERS = st.lists(st.sampled_from(EMOTIONS), min_size=2, max_size=20)
OFTEN = "joy joy joy joy joy joy joy anger anger pride surprise"


@given(answers=ANSWERS, separator=st.sampled_from([" ", ", ", ",", ";", " ; ", "|", "\t", "\n", "/", " / ", ""]))
def test_every_separator_gives_the_same_counts(answers: list[str], separator: str) -> None:
    counts = count_answers(separator.join(answers))
    assert counts == {name: answers.count(name) for name in answers}


@given(answers=ANSWERS)
def test_lists_and_dictionaries_are_understood(answers: list[str]) -> None:
    expected = {name: answers.count(name) for name in answers}
    assert count_answers(repr(answers)) == expected
    assert count_answers(repr(expected)) == expected
    for pattern in ("{}: {}", "{} {}", "{}={}", "{1} {0}", "{} ({})"):
        written = "; ".join(pattern.format(name, count) for name, count in expected.items())
        assert count_answers(written) == expected, written
    assert count_answers(" ".join(f"{name} {count}" for name, count in expected.items())) == expected


def test_n_is_read_and_kept() -> None:
    assert label_from_responses("joy", OFTEN) == Label("joy", 7 / 11, 7, 11)
    assert label_from_responses("joy", "joy,anger,joy") == Label("joy", 2 / 3, 2, 3)
    assert label_from_responses("shame", OFTEN) == Label("shame", 0.0, 0, 11)


def test_case_and_synonyms_are_one_emotion() -> None:
    assert label_from_responses("Happiness", "JOY; happy; Joy; angry") == Label("joy", 0.75, 3, 4)


def test_an_unknown_answer_counts_into_n_but_an_empty_one_does_not() -> None:
    label = label_from_responses("joy", "joy; no emotion at all; contempt; ; n/a; NaN")
    assert (label.votes, label.observers) == (1, 3)
    assert label_from_responses("joy", "joy/n/a/anger").observers == 2


def test_nothing_is_not_a_label() -> None:
    for empty in ("", "  ", "[]", "nan", ";;"):
        with pytest.raises(DataError, match="no responses"):
            label_from_responses("joy", empty)
    with pytest.raises(DataError, match="contempt"):
        label_from_responses("contempt", OFTEN)


@pytest.mark.parametrize("text", ["7/11", " 7 / 11 ", "7 of 11"])
def test_votes(text: str) -> None:
    assert label_from_votes("joy", text) == Label("joy", 7 / 11, 7, 11)


@pytest.mark.parametrize("text", ["12/11", "0/0", "7", "7/", "-1/11", "0.6", "7/11.0", "7/11/2", ""])
def test_votes_that_are_none(text: str) -> None:
    with pytest.raises(DataError, match="votes"):
        label_from_votes("joy", text)
