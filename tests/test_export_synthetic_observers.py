"""Observers: shares, confusions, votes."""

import numpy as np
import pytest

from fervor.emotions import EMOTIONS
from fervor_export.synthetic.observers import CONFUSED, GUESS, LAPSE, Panel, named, recognised


@pytest.mark.parametrize("emotion", EMOTIONS)
def test_the_more_shows_the_more_observers_recognise_it(emotion: str) -> None:
    shares = [recognised(emotion, visible) for visible in np.linspace(-0.3, 1.4, 30)]
    assert (np.diff(shares) > 0.0).all()
    assert GUESS < shares[0] < 0.15
    assert 0.85 < shares[-1] < 1.0 - LAPSE


def test_another_emotion_s_display_is_rarely_named_but_similar_ones_are_confused() -> None:
    assert named("anger", "sadness", 1.0) < 0.05
    assert named("anger", "sadness", 0.0) > named("anger", "sadness", 1.0)
    assert 0.2 < named("joy", "amusement", 1.0) < named("amusement", "amusement", 1.0)
    assert named("sadness", "shame", 1.0) == named("sadness", "shame", 1.0)


def test_showing_nothing_is_called_neutral() -> None:
    shares = [named("neutral", "joy", visible) for visible in (0.0, 0.5, 1.0)]
    assert shares[0] > 0.85
    assert shares[0] > shares[1] > shares[2]
    assert all(0.0 <= named(first, second, v) <= 1.0 for first in EMOTIONS for second in EMOTIONS for v in (-1.0, 2.0))


def test_confusions_name_known_emotions() -> None:
    assert all(pair <= set(EMOTIONS) and len(pair) == 2 for pair in CONFUSED)


def test_a_panel_votes_in_whole_people_around_the_share() -> None:
    rng = np.random.default_rng(0)
    panels = [Panel.draw(rng) for _ in range(300)]
    assert {panel.size for panel in panels} == {9, 10, 11, 12, 13}
    votes = np.array([panel.vote(rng, 0.4) * panel.size for panel in panels])
    assert np.allclose(votes, votes.round())
    assert abs(np.mean([panel.vote(rng, 0.4) for panel in panels]) - 0.4) < 0.04
