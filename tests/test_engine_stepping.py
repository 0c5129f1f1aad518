"""Steps' poses the short way and the long one; what lanes say, checked and weighted."""

import numpy as np
import pytest

from bodies import motion
from fervor.emotions import emotion_vector
from fervor.engine.posing import Poses, between
from fervor.engine.stepping import blend, emotions_at, poses_at, spoken
from fervor.errors import EngineError
from fervor.session.events import Step
from fervor.session.label import make_label


def step(fraction: float, *, held: bool = False, emotion: str = "joy") -> Step:
    return Step(fraction, held, 3, 0, make_label(emotion, 0.0, None))


@pytest.mark.parametrize(
    "steps",
    [
        [step(0.2), step(0.9), step(0.5)],
        [step(1.0), step(1.0), step(1.0)],
        [step(0.2), step(1.0), step(0.5)],
        [step(0.2, held=True), step(0.9), step(1.0)],
    ],
    ids=["on the way", "arrived", "both", "held"],
)
def test_poses_are_those_between_two_whatever_the_way(steps):
    seen = np.ones((3, 13), np.bool_)
    seen[1, 4] = False
    old, new = Poses(motion(3, seed=1), seen), Poses(motion(3, seed=2), seen[::-1])
    fraction, held = np.array([each.fraction for each in steps]), np.array([each.held for each in steps])
    for got, expected in zip(poses_at(steps, old, new), between(old, new, fraction, held), strict=True):
        assert got.dtype == np.float32
        assert got.tobytes() == expected.tobytes()


def test_emotions_are_the_labels_vectors():
    rows = emotions_at([step(1.0), step(1.0, emotion="anger")])
    assert np.array_equal(rows, [emotion_vector("joy"), emotion_vector("anger")])


def test_what_is_said_is_checked():
    intensity, by_emotion = np.full((2, 3), 0.5, np.float32), np.full((2, 3, 11), 0.25, np.float32)
    assert spoken(intensity, by_emotion).tolist() == [[[0.5, *[0.25] * 11]] * 3] * 2
    for poison in (np.nan, np.inf, -np.inf):
        intensity[1, 2] = poison
        with pytest.raises(EngineError, match="not finite"):
            spoken(intensity, by_emotion)


def test_lanes_are_weighted():
    by_lane = np.array([[[1.0, 2.0], [3.0, 4.0]], [[5.0, 6.0], [np.pi, 8.0]]])  # [step, lane, k]
    assert blend(by_lane, np.array([[0.25, 0.75], [1.0, 0.0]])).tolist() == [[2.5, 3.5], [5.0, 6.0]]
