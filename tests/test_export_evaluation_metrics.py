"""Metrics, against scipy and by their definitions; what is not defined is None."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import pearsonr

from fervor_export.evaluation.metrics import Figure, difference, pearson, score, within_emotions
from networks import waving_clips


def data(count: int = 200, *, noise: float = 0.2, seed: int = 0, actors: int = 8):
    random = np.random.default_rng(seed)
    clips = waving_clips(count, actors=actors, seed=seed)
    target = np.asarray([clip.intensity for clip in clips])
    return clips, target, np.clip(target + random.normal(0, noise, count), 0, 1)


def felt(clips):
    return np.asarray([clip.emotion != "neutral" for clip in clips])


def test_pooled_numbers_by_their_definitions():
    clips, target, said = data()
    scores, mine = score(said, clips), felt(clips)
    p, t = said[mine], target[mine]
    assert scores.r_all.value == pytest.approx(pearsonr(said, target).statistic, abs=1e-4)
    assert scores.r.value == pytest.approx(pearsonr(p, t).statistic, abs=1e-4)
    assert scores.mae.value == pytest.approx(np.abs(p - t).mean(), abs=1e-4)
    assert scores.spread.value == pytest.approx(p.std() / t.std(), abs=1e-4)
    ccc = 2 * np.cov(p, t, bias=True)[0, 1] / (p.var() + t.var() + (p.mean() - t.mean()) ** 2)
    assert scores.ccc.value == pytest.approx(ccc, abs=1e-4)
    assert scores.clips == 200


def test_within_emotions_is_fishers_mean_without_neutral():
    clips, target, said = data()
    emotions = np.asarray([clip.emotion for clip in clips])
    z, weight = [], []
    for emotion in np.unique(emotions):
        mine = emotions == emotion
        r = pearsonr(said[mine], target[mine]).statistic
        assert score(said, clips).emotions[emotion].value == pytest.approx(r, abs=1e-4)
        if emotion != "neutral":
            z.append(np.arctanh(r))
            weight.append(mine.sum() - 3)
    expected = np.tanh(np.average(z, weights=weight))
    assert score(said, clips).r_within.value == pytest.approx(expected, abs=1e-4)
    assert within_emotions(said, clips) == pytest.approx(expected, abs=1e-4)
    assert score(said, clips).emotions_counted == 10


def test_knowing_the_emotion_alone_is_no_within_emotion_r():
    clips, _, _ = data()
    clips = [replace(clip, intensity=0.5 * clip.intensity + 0.5 * (clip.emotion < "f")) for clip in clips]
    said = np.asarray([0.75 if clip.emotion < "f" else 0.25 for clip in clips])
    scores = score(said, clips)
    assert scores.r.value > 0.7
    assert scores.r_within == Figure(None)
    assert scores.emotions_counted == 0
    folds = np.arange(len(clips)) % 5
    wavering = said + 0.01 * folds  # means of folds differ, but within each fold nothing varies
    assert score(wavering, clips, folds=folds).r_within == Figure(None)
    assert score(wavering, clips).r_within.value is not None


def test_constants_and_the_empty_have_no_numbers():
    clips, _, said = data(60)
    constant = score(np.full(60, 0.4), clips)
    assert (constant.r_all.value, constant.r.value, constant.r_within.value) == (None, None, None)
    assert constant.mae.value is not None
    assert constant.spread.value == 0.0
    labels = score(said, [replace(clip, intensity=0.5) for clip in clips])
    assert (labels.r.value, labels.spread.value) == (None, None)
    nothing = score(np.full(60, np.nan), clips)
    assert (nothing.clips, nothing.mae.value, nothing.r.value) == (0, None, None)
    assert pearson(np.ones(5), np.arange(5.0)) is None
    assert pearson(np.arange(2.0), np.arange(2.0)) is None


def test_clips_without_a_prediction_do_not_count():
    clips, target, said = data(100)
    part = np.where(np.arange(100) < 70, said, np.nan)
    assert score(part, clips).r_all.value == pytest.approx(pearsonr(said[:70], target[:70]).statistic, abs=1e-4)


def test_neutral_is_in_nothing_but_the_papers_number():
    clips, _, said = data()
    spoilt = np.where(felt(clips), said, 1 - said)
    before, after = score(said, clips), score(spoilt, clips)
    assert after.r_all.value < before.r_all.value
    for name in ("r", "r_within", "mae", "ccc", "spread"):
        assert getattr(before, name) == getattr(after, name)
    assert after.emotions["neutral"].value < 0


def test_absent_emotions_are_absent():
    clips, _, said = data(100)
    kept = [index for index, clip in enumerate(clips) if clip.emotion in {"joy", "anger"}]
    scores = score(said[kept], [clips[index] for index in kept])
    assert set(scores.emotions) == {"joy", "anger"}
    assert scores.r_within.value is not None


def test_intervals_resample_actors_not_clips():
    """Where actors differ, an interval over them is wide, however many clips they have."""
    random = np.random.default_rng(0)
    clips = waving_clips(1600, actors=8)
    target = np.asarray([clip.intensity for clip in clips])
    skill = {f"actor{index}": value for index, value in enumerate(np.linspace(-0.5, 1, 8))}
    said = np.asarray([skill[clip.actor] * clip.intensity for clip in clips]) + random.normal(0, 0.05, 1600)
    figure = score(said, clips).r_all
    assert figure.low < figure.value < figure.high
    assert figure.high - figure.low > 0.3
    alone = score(target + random.normal(0, 0.05, 1600), clips).r_all
    assert alone.high - alone.low < 0.02


def test_the_bootstrap_is_that_of_the_definition():
    clips, target, said = data(120, actors=5)
    actors = np.asarray([clip.actor for clip in clips])
    drawn = np.random.default_rng(0).multinomial(5, np.full(5, 0.2), size=1000)
    names = np.unique(actors)
    values = []
    for counts in drawn:
        rows = np.concatenate(
            [np.tile(np.flatnonzero(actors == name), count) for name, count in zip(names, counts, strict=True)]
        )
        values.append(pearsonr(said[rows], target[rows]).statistic)
    figure = score(said, clips, seed=0).r_all
    assert (figure.low, figure.high) == pytest.approx(np.percentile(values, (2.5, 97.5)), abs=1e-3)


def test_one_actor_has_no_interval():
    clips, _, said = data(60, actors=1)
    figure = score(said, clips).r
    assert figure.value is not None
    assert (figure.low, figure.high) == (None, None)


def test_differences_are_paired():
    clips, target, said = data(300, noise=0.3)
    better = 0.5 * (said + target)
    figure = difference(better, said, clips)
    assert 0 < figure.low <= figure.value <= figure.high
    assert difference(said, said, clips) == Figure(0.0, 0.0, 0.0)
    assert difference(said, np.full(300, 0.5), clips).value is None
    assert difference(said, better, clips, number="mae").value > 0
