"""How long an emotion label holds."""

import pytest

from fervor.errors import InputError
from fervor.session.label import ANALYSER_TTL_S, NO_LABEL, make_label


def test_a_plain_label_holds_for_ever():
    label = make_label("joy", 3.0, None)
    assert label.at(1e9) is label
    assert label.name == "joy"


def test_probabilities_expire_into_unknown():
    label = make_label({"joy": 0.6, "anger": 0.4}, 3.0, None)
    assert label.at(3.0 + ANALYSER_TTL_S) is label
    assert label.at(3.001 + ANALYSER_TTL_S) is NO_LABEL
    assert label.name == "joy"


def test_the_session_may_say_how_long():
    assert make_label("joy", 0.0, 0.5).at(0.6).name == "unknown"
    assert make_label({"joy": 1.0}, 0.0, 60.0).at(59.0).name == "joy"


@pytest.mark.parametrize("bad", ["joie", {"joy": -0.1}, {"joy": float("nan")}, {"glee": 1.0}])
def test_impossible_labels_are_refused(bad):
    with pytest.raises(InputError, match=r"emotion .* (expected|probability)"):
        make_label(bad, 0.0, None)
