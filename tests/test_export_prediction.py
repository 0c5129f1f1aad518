"""Predictions for clips, and the thresholds that follow."""

import numpy as np
import pytest
import torch

from fervor.emotions import EMOTIONS
from fervor_export.prediction import Predictions, fit, predict
from fervor_export.recipe import DEFAULT, PAPER
from networks import network, waving_clips


def test_predictions_do_not_depend_on_company():
    validate = waving_clips(20)
    together = predict(network(), validate, DEFAULT)
    alone = [predict(network(), [clip], DEFAULT) for clip in validate[:5]]
    for index, one in enumerate(alone):
        assert together.labelled[index] == pytest.approx(one.labelled[0], abs=1e-5)
        assert together.unlabelled[index] == pytest.approx(one.unlabelled[0], abs=1e-5)


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


def test_neutral_has_no_intensity_to_fit():
    clips = waving_clips(22)
    target = np.asarray([clip.intensity for clip in clips])
    wrong = np.where([clip.emotion == "neutral" for clip in clips], 1 - target, target)
    assert fit(clips, Predictions(wrong, wrong)).mae == 0
    only = [clip for clip in clips if clip.emotion == "neutral"]
    assert fit(only, Predictions(np.ones(2), np.ones(2))).mae > 0
