"""The baseline learns what its features show, and its search never parts from grouped folds."""

import numpy as np
import pytest
from sklearn.model_selection import GridSearchCV

from fervor_export.evaluation import baseline
from fervor_export.evaluation.metrics import pearson
from networks import waving_clips

SMALL = {"svr__C": (1.0, 10.0), "svr__gamma": ("scale",), "svr__epsilon": (0.05,)}


def test_it_learns_and_stays_within_bounds():
    clips = waving_clips(80)
    target = np.asarray([clip.intensity for clip in clips])
    features = np.stack([target, np.random.default_rng(0).normal(size=80)], axis=1)
    fitted = baseline.fit(features[:60], clips[:60], grid=SMALL)
    said = baseline.predict(fitted, features[60:] * 3, clips[60:])
    assert said.min() >= 0
    assert said.max() <= 1
    assert pearson(baseline.predict(fitted, features[60:], clips[60:]), target[60:]) > 0.8


def test_the_emotion_is_told_or_not():
    clips = waving_clips(66)
    features = np.zeros((66, 3))
    told = baseline.fit(features, clips, grid=SMALL)
    untold = baseline.fit(features, clips, grid=SMALL, with_emotion=False)
    assert told.n_features_in_ == 14
    assert untold.n_features_in_ == 3
    assert baseline.predict(untold, features, clips, with_emotion=False).std() < 1e-9
    assert baseline.predict(told, features, clips).std() > 1e-3


def test_the_search_parts_actors(monkeypatch):
    seen = []

    class Spy(GridSearchCV):
        def fit(self, inputs, target, groups=None):
            seen.append((self.cv, list(groups)))
            for learn, judge in self.cv.split(inputs, target, groups):
                assert not {groups[row] for row in learn} & {groups[row] for row in judge}
            return super().fit(inputs, target, groups=groups)

    monkeypatch.setattr(baseline, "GridSearchCV", Spy)
    clips = waving_clips(30)
    baseline.fit(np.random.default_rng(0).normal(size=(30, 4)), clips, grid=SMALL)
    assert seen[0][1] == [clip.actor for clip in clips]
    baseline.fit(np.zeros((6, 4)), waving_clips(6, actors=1), grid=SMALL)
    assert seen[1][1] == [clip.name for clip in clips[:6]]


def test_one_clip_is_enough_to_say_something():
    clip = waving_clips(1)
    fitted = baseline.fit(np.ones((1, 2)), clip, grid=SMALL)
    assert baseline.predict(fitted, np.ones((1, 2)), clip) == pytest.approx([clip[0].intensity], abs=0.11)
