"""Estimates are those of `prediction`, of the network and of its model file."""

import numpy as np
import pytest

from fervor.model import Model
from fervor_export.evaluation.estimator import ModelEstimator, Motion, NetworkEstimator, Reading
from fervor_export.prediction import predict
from fervor_export.recipe import DEFAULT, PAPER
from networks import model_bytes, network, waving_clips

CLIPS = waving_clips(20)
MOTIONS = [Motion.of(clip) for clip in CLIPS]


@pytest.mark.parametrize("recipe", [DEFAULT, PAPER])
def test_a_clips_number_is_that_of_prediction(recipe):
    expected = predict(network(), CLIPS, recipe)
    estimates, reading = NetworkEstimator(network()).estimate(MOTIONS), Reading.of(recipe)
    assert reading.labelled(CLIPS, estimates) == pytest.approx(expected.labelled, abs=1e-5)
    assert reading.unlabelled(estimates) == pytest.approx(expected.unlabelled, abs=1e-5)
    assert [len(values) for values in estimates] == [clip.frames for clip in CLIPS]


def test_a_model_file_estimates_what_its_network_does():
    here = NetworkEstimator(network()).estimate(MOTIONS)
    there = ModelEstimator(Model.load(model_bytes())).estimate(MOTIONS)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_nothing_is_estimated_of_nothing():
    assert NetworkEstimator(network()).estimate([]) == []
