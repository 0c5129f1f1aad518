"""Predictions for clips, and the thresholds that follow."""

import numpy as np
import pytest
import torch

from fervor.emotions import EMOTIONS
from fervor_export.prediction import Predictions, fit, level_rule, predict
from fervor_export.recipe import DEFAULT, PAPER
from networks import network, waving_clips


def test_predictions_do_not_depend_on_company():
    validate = waving_clips(20)
    together = predict(network(), validate, DEFAULT)
    alone = [predict(network(), [clip], DEFAULT) for clip in validate[:5]]
    for index, one in enumerate(alone):
        assert together.labelled[index] == pytest.approx(one.labelled[0], abs=1e-5)
        assert together.unlabelled[index] == pytest.approx(one.unlabelled[0], abs=1e-5)


def test_thresholds_split_each_emotion_in_halves():
    clips = waving_clips(44)
    labelled = np.linspace(0, 1, 44)
    rule = level_rule(clips, Predictions(labelled, labelled / 2))
    for index, emotion in enumerate(EMOTIONS):
        assert rule.threshold[emotion] == pytest.approx(np.median(labelled[index::11]), abs=0.006)
    assert rule.threshold["unknown"] == 0.25
    few = level_rule(clips[:1], Predictions(labelled[:1] + 0.4, labelled[:1]))
    assert few.threshold["surprise"] == 0.4


def test_the_paper_reads_the_last_frame_the_default_the_mean():
    clip = waving_clips(1)[0]
    for recipe, expected in ((PAPER, slice(-1, None)), (DEFAULT, slice(30, None))):
        with torch.no_grad():
            outputs = network()(*_inputs(clip))
        one = predict(network(), [clip], recipe)
        assert one.labelled[0] == pytest.approx(float(outputs.intensity[0, expected].mean()), abs=1e-5)


def _inputs(clip):
    emotion = torch.zeros(1, clip.frames, len(EMOTIONS))
    emotion[..., EMOTIONS.index(clip.emotion)] = 1
    return torch.from_numpy(clip.rotations)[None], torch.from_numpy(clip.mask)[None].float(), emotion


def test_the_fit_is_of_labelled_predictions():
    clips = waving_clips(12)
    target = np.asarray([clip.intensity for clip in clips])
    assert fit(clips, Predictions(target, np.zeros(12))).mae == 0
