"""The tables are complete, use only names that exist, and stay in range."""

import numpy as np
import pytest

from fervor.emotions import EMOTIONS
from fervor_export.synthetic.channels import CHANNELS, INDEX, blend, bounds, distance
from fervor_export.synthetic.gestures import GESTURES
from fervor_export.synthetic.repertoire import CONVERSATION, MOOD_OF_REST, REPERTOIRE, REST, RESTING
from fervor_export.synthetic.table import TABLE


def test_every_emotion_has_its_rows() -> None:
    assert set(TABLE) == set(EMOTIONS) == set(REPERTOIRE)
    assert set(MOOD_OF_REST) <= set(EMOTIONS)


def test_every_name_in_a_table_exists() -> None:
    assert all(set(row) <= set(INDEX) for row in TABLE.values())
    assert all(set(row) <= set(GESTURES) for row in [*REPERTOIRE.values(), CONVERSATION])
    assert all(set(row) <= set(REST) for row in [*RESTING.values(), *MOOD_OF_REST.values()])


def test_every_gesture_is_used() -> None:
    assert set(GESTURES) == set(CONVERSATION).union(*REPERTOIRE.values())


@pytest.mark.parametrize("emotion", EMOTIONS)
def test_weak_and_strong_lie_within_the_channels_ranges(emotion: str) -> None:
    weak, strong, spread = bounds(emotion)
    for value in (weak, strong):
        assert all(channel.low <= x <= channel.high for channel, x in zip(CHANNELS, value, strict=True))
    assert (spread >= 0.0).all()


@pytest.mark.parametrize("emotion", EMOTIONS)
def test_a_blend_runs_from_weak_to_strong(emotion: str) -> None:
    weak, strong, _ = bounds(emotion)
    shares = np.linspace(0.0, 1.0, 11)[:, None]
    values = blend(weak, strong, shares)
    assert np.allclose(values[0], weak)
    assert np.allclose(values[-1], strong)
    steps = np.diff(values, axis=0) * np.sign(strong - weak)
    assert (steps >= -1e-12).all()


def test_at_intensity_0_all_emotions_look_nearly_alike() -> None:
    neutral = bounds("neutral")[0]
    for emotion in EMOTIONS:
        weak, strong, _ = bounds(emotion)
        assert np.abs(distance(neutral, weak)).max() < 0.5
        if emotion != "neutral":
            assert np.abs(distance(neutral, strong)).sum() > 10.0
