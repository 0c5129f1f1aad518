"""What shows: more with intensity, less when it can't be seen, and strangers' habits are half taken for it."""

import dataclasses

import numpy as np
import pytest

from fervor.emotions import EMOTIONS
from fervor_export.synthetic.channels import CHANNELS, INDEX
from fervor_export.synthetic.manner import Manner, habit
from fervor_export.synthetic.motion import constant
from fervor_export.synthetic.person import USUAL_STEP_HZ, Person
from fervor_export.synthetic.scene import Scene

TIMES = np.linspace(0.0, 4.0, 121)
SEEN = {"posture": 1.0, "gesture": 1.0, "gait": 0.0, "rhythm": 1.0}
NOTHING = np.zeros(len(CHANNELS))


def average_person(seed: int = 0) -> Person:
    person = Person.draw(np.random.default_rng(seed), "somebody")
    return dataclasses.replace(
        person, idiom=NOTHING, tempo=1.0, size=1.0, rate=1.0, unrest=1.0, nod=1.0, slump=0.0, lean=0.0, head=0.0,
        step_hz=USUAL_STEP_HZ,
    )  # fmt: skip


def manner(emotion: str, level: float, person: Person | None = None, variety: float = 0.0) -> Manner:
    rng = np.random.default_rng(0)
    return Manner.draw(rng, emotion, constant(level), person or average_person(), variety=variety)


@pytest.mark.parametrize("emotion", [emotion for emotion in EMOTIONS if emotion != "neutral"])
def test_an_average_take_shows_as_much_as_it_is_intense(emotion: str) -> None:
    for level in (0.0, 0.3, 0.7, 1.0):
        assert np.isclose(manner(emotion, level).visible(TIMES, SEEN, {}, NOTHING), level, atol=0.05)


def test_neutral_shows_nothing() -> None:
    assert manner("neutral", 1.0).visible(TIMES, SEEN, {}, NOTHING) == 0.0


def test_channels_deviate_from_the_intensity_but_not_where_nothing_is_felt() -> None:
    spread = [
        manner("joy", level, variety=0.2).over(TIMES)[0] - manner("joy", level).over(TIMES)[0] for level in (0.0, 0.8)
    ]
    assert np.abs(spread[0]).max() == 0.0
    assert np.abs(spread[1]).max() > 0.0


def test_gestures_that_nobody_makes_show_less() -> None:
    joyful = manner("joy", 0.9)
    made, missing = (joyful.visible(TIMES, SEEN, {"emblem": share}, NOTHING) for share in (0.8, 0.0))
    assert made > missing


def test_a_lively_person_looks_more_joyful_and_less_sad_to_strangers() -> None:
    scene = dataclasses.replace(Scene.draw(np.random.default_rng(0)), vigour=1.0, pace=1.0, drive=1.0)
    lively = dataclasses.replace(average_person(), tempo=1.4, size=1.3, rate=1.5)
    assert np.abs(habit(average_person(), scene)).max() < 1e-9
    extra = habit(lively, scene)
    assert extra[INDEX["tempo"]] > 1.0
    for emotion, sign in (("joy", 1), ("sadness", -1)):
        shown = manner(emotion, 0.5)
        change = shown.visible(TIMES, SEEN, {}, extra) - shown.visible(TIMES, SEEN, {}, NOTHING)
        assert sign * change > 0.02


def test_viewers_go_by_the_stronger_moments() -> None:
    def course(times: np.ndarray) -> np.ndarray:
        return np.where(times > 2.5, 1.0, 0.0)

    burst = Manner.draw(np.random.default_rng(0), "anger", course, average_person(), variety=0.0)
    assert burst.visible(TIMES, SEEN, {}, NOTHING) > 0.37 + 0.1  # the mean alone would be 0.37
