"""Scores, against numpy and by their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fervor_export.scores import concordance, pearson, score

pairs = arrays(np.float64, (2, 12), elements=st.floats(0, 1)).filter(lambda a: a.std(1).min() > 1e-3)


@given(pairs)
def test_pearson_is_numpys(pair):
    assert pearson(*pair) == pytest.approx(np.corrcoef(*pair)[0, 1], abs=1e-9)


@given(pairs)
def test_concordance_is_at_most_pearson(pair):
    assert abs(concordance(*pair)) <= abs(pearson(*pair)) + 1e-9
    assert concordance(pair[0], pair[0]) == pytest.approx(1)


def test_constants_score_nothing():
    assert pearson(np.ones(5), np.arange(5.0)) == 0
    assert concordance(np.ones(5), np.ones(5)) == 0


def test_within_emotion_does_not_reward_knowing_the_emotion():
    emotions = ["joy"] * 4 + ["anger"] * 4
    target = np.asarray([0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9])
    by_emotion = np.asarray([0.25] * 4 + [0.75] * 4)
    scores = score(by_emotion, target, emotions)
    assert scores.r > 0.8
    assert scores.r_within == 0
    assert score(target, target, emotions).r_within == pytest.approx(1)
    assert score(target[:2], target[:2], emotions[:2]).r_within == 0


def test_names_and_values():
    target = np.asarray([0.0, 0.5, 1.0])
    assert score(target + 0.25, target, ["joy"] * 3).as_dict("test_") == {
        "test_mae": 0.25, "test_r": 1.0, "test_r_within": 1.0, "test_ccc": 0.8421, "test_spread": 1.0,
    }  # fmt: skip
