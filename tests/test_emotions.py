"""Names and vectors of emotions."""

import numpy as np
import pytest

from fervor.emotions import EMOTIONS, SYNONYMS, dominant_emotion, emotion_index, emotion_vector
from fervor.errors import InputError


def test_eleven_emotions_each_one_hot():
    assert len(EMOTIONS) == len(set(EMOTIONS)) == 11
    vectors = np.stack([emotion_vector(name) for name in EMOTIONS])
    assert np.array_equal(vectors, np.eye(11, dtype=np.float32))
    assert [dominant_emotion(vector) for vector in vectors] == list(EMOTIONS)


def test_synonyms_and_case_are_understood():
    assert emotion_index(" Happy ") == EMOTIONS.index("joy")
    assert {emotion_index(name) for name in SYNONYMS} <= set(range(11))


def test_unknown_is_all_zero():
    for label in (None, "unknown", {}):
        assert not emotion_vector(label).any()
    assert dominant_emotion(emotion_vector(None)) == "unknown"


def test_probabilities_keep_their_sum_unless_it_exceeds_one():
    assert emotion_vector({"joy": 0.25, "fear": 0.25}).sum() == np.float32(0.5)
    assert emotion_vector({"joy": 1.0, "happy": 1.0})[EMOTIONS.index("joy")] == 1.0


def test_a_misspelt_emotion_is_refused_not_silently_unknown():
    with pytest.raises(InputError, match="'joi' is not known; expected one of amusement, anger"):
        emotion_vector("joi")
    with pytest.raises(InputError, match="probability inf"):
        emotion_vector({"joy": float("inf")})
