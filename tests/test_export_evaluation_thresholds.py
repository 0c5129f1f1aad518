"""Thresholds part weak from strong, fall back where clips are few, and are judged by other clips than chose them."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.metrics import balanced_accuracy_score

from fervor.emotions import EMOTIONS
from fervor_export.evaluation.thresholds import choose_thresholds, confusion, levels
from networks import waving_clips


def intensities(clips):
    return np.asarray([clip.intensity for clip in clips])


def test_a_threshold_parts_what_can_be_parted():
    clips = waving_clips(220)
    said = 0.2 + 0.3 * intensities(clips)
    chosen = choose_thresholds(clips, said, said + 0.1)
    assert chosen.own == EMOTIONS
    for emotion in EMOTIONS:
        mine = [index for index, clip in enumerate(clips) if clip.emotion == emotion]
        strong = intensities(clips)[mine] >= chosen.boundary[emotion]
        assert ((said[mine] >= chosen.rule.threshold[emotion]) == strong).all()
        assert chosen.boundary[emotion] == pytest.approx(np.median(intensities(clips)[mine]))
    assert chosen.rule.threshold["unknown"] == pytest.approx(0.1 + 0.2 + 0.3 * 0.5, abs=0.05)


def test_emotions_with_few_clips_have_the_common_threshold():
    clips = [clip for clip in waving_clips(220) if clip.emotion in {"joy", "anger", "pride"}]
    kept = [clip for index, clip in enumerate(clips) if clip.emotion != "pride" or index < 8]
    chosen = choose_thresholds(kept, intensities(kept), intensities(kept))
    assert chosen.own == ("anger", "joy")
    assert chosen.rule.threshold["pride"] == chosen.rule.threshold["sadness"]
    assert set(chosen.rule.threshold) == {*EMOTIONS, "unknown"}


def test_a_network_that_tells_nothing_apart_still_shows_both_levels():
    clips = waving_clips(440)
    random = np.random.default_rng(0)
    said = 1 - intensities(clips) + random.normal(0, 0.01, 440)  # upside down: extremes would be best
    rule = choose_thresholds(clips, said, said).rule
    for emotion in EMOTIONS:
        mine = said[[clip.emotion == emotion for clip in clips]]
        assert 0.15 < (mine >= rule.threshold[emotion]).mean() < 0.85


def test_constant_or_absent_predictions_have_a_middle():
    clips = waving_clips(44)
    assert choose_thresholds(clips, np.full(44, 0.3), np.full(44, 0.3)).rule.threshold["joy"] == 0.5
    assert choose_thresholds([], np.empty(0), np.empty(0)).rule.threshold["unknown"] == 0.5


def test_levels_are_not_judged_by_the_clips_their_thresholds_come_from():
    clips = waving_clips(330)
    random = np.random.default_rng(7)
    noise, folds = random.random(330), np.arange(330) % 5
    assert levels(clips, noise, folds).balanced_accuracy < 0.52
    flattered = choose_thresholds(clips, noise, noise).rule
    told = np.asarray([said >= flattered.threshold[clip.emotion] for clip, said in zip(clips, noise, strict=True)])
    median = {e: np.median([c.intensity for c in clips if c.emotion == e]) for e in EMOTIONS}
    true = np.asarray([clip.intensity >= median[clip.emotion] for clip in clips])
    assert balanced_accuracy_score(true, told) > 0.55
    perfect = levels(clips, intensities(clips), folds)
    assert perfect.balanced_accuracy > 0.85
    assert set(perfect.emotions) == set(EMOTIONS)
    assert sum((perfect.all.weak_as_weak, perfect.all.weak_as_strong, perfect.all.strong_as_weak,
                perfect.all.strong_as_strong)) == 300  # neutral apart  # fmt: skip


def test_one_fold_is_cut_in_parts():
    clips = waving_clips(110)
    assert levels(clips, intensities(clips), np.zeros(110, int)).balanced_accuracy > 0.8


def test_confusion_is_scikit_learns():
    random = np.random.default_rng(0)
    true, told = random.random(50) < 0.4, random.random(50) < 0.6
    assert confusion(true, told).balanced_accuracy == pytest.approx(balanced_accuracy_score(true, told), abs=1e-4)
    assert confusion(np.ones(3, bool), np.ones(3, bool)).balanced_accuracy is None


def test_labels_all_alike_have_one_level():
    clips = [replace(clip, intensity=0.0) for clip in waving_clips(55)]
    assert levels(clips, np.random.default_rng(0).random(55), np.arange(55) % 5).balanced_accuracy is None
