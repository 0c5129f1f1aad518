"""Scripts: gestures follow the person's rate, the emotion's repertoire and its events."""

import dataclasses

import numpy as np
import pytest

from fervor_export.synthetic.director import Director
from fervor_export.synthetic.gestures import GESTURES
from fervor_export.synthetic.manner import Manner
from fervor_export.synthetic.motion import constant
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.repertoire import REST
from fervor_export.synthetic.scene import Activity, Scene
from fervor_export.synthetic.script import Hand, Script, around, place


def script(
    emotion: str, level: float, seed: int, *, activity: Activity = "talk", events: tuple[float, ...] = ()
) -> Script:
    rng = np.random.default_rng(seed)
    person, scene = Person.draw(rng, "somebody"), Scene.draw(rng, "stand", activity)
    manner = Manner.draw(rng, emotion, constant(level), person)
    return Director(rng, person, scene, manner, seconds=20.0, events=events).write()


def made(emotion: str, level: float, kind: str = "gestures", activity: Activity = "talk") -> float:
    return float(np.mean([len(getattr(script(emotion, level, seed, activity=activity), kind)) for seed in range(15)]))


def test_joy_and_anger_gesture_more_and_sadness_less() -> None:
    assert made("joy", 1.0) > 1.2 * made("joy", 0.0)
    assert made("anger", 1.0) > 1.2 * made("anger", 0.0)
    assert made("sadness", 1.0) < 0.7 * made("sadness", 0.0)


def test_strong_emotions_use_their_own_gestures_and_neutral_has_none() -> None:
    assert made("fear", 1.0, "emblems") > 4.0 * made("fear", 0.0, "emblems")
    assert made("neutral", 1.0, "emblems") == 0.0
    assert made("joy", 1.0, "emblems", "task") < 0.6 * made("joy", 1.0, "emblems", "act")


def test_listeners_hardly_gesture() -> None:
    assert made("neutral", 0.0, activity="listen") < 0.5 * made("neutral", 0.0, activity="talk")


def test_amusement_laughs() -> None:
    assert not script("joy", 1.0, 0).laughs
    assert sum(len(script("amusement", 0.9, seed).laughs) for seed in range(5)) > 10


@pytest.mark.parametrize("seed", range(8))
def test_an_event_is_answered_at_once_with_a_gesture_of_the_emotion(seed: int) -> None:
    answered = script("surprise", 1.0, seed, events=(6.0,))
    assert any(5.7 < begin < 6.3 for begin, _ in answered.emblems)


def test_touching_the_body_is_not_scaled_with_the_mood() -> None:
    rng = np.random.default_rng(0)
    person = dataclasses.replace(Person.draw(rng, "somebody"), size=1.0)
    scene = dataclasses.replace(Scene.draw(rng, "stand"), vigour=1.0)
    manner = Manner.draw(rng, "joy", constant(1.0), person, variety=0.0)
    director, style = Director(rng, person, scene, manner, seconds=1.0), manner.at(0.0)
    for name, free in (("cover_face", False), ("open", True)):
        gesture = GESTURES[name]
        plain = place(gesture.poses[-1], scene, person)[Hand.CHEST]
        moved = np.linalg.norm(director.target(gesture, gesture.poses[-1], style)[Hand.CHEST] - plain)
        assert (moved > 0.06) == free


def test_hands_go_around_the_shoulder() -> None:
    rng = np.random.default_rng(0)
    person, scene = Person.draw(rng, "somebody"), Scene.draw(rng, "stand")
    hanging = place(REST["hang"], scene, person)
    raised = hanging.copy()
    raised[Hand.CHEST], raised[Hand.ROOM] = (0.3, 0.45, 0.05), 0.0
    way, bow = around(hanging, raised)
    straight = np.linalg.norm((raised - hanging)[Hand.CHEST] + (raised - hanging)[Hand.ROOM])
    assert bow[Hand.CHEST.stop - 1] > 0.2  # in front
    assert way > straight
    assert np.allclose(around(hanging, hanging)[1], 0.0, atol=1e-9)
