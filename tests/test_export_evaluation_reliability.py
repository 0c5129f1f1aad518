"""The calibration curve, by hand and against scikit-learn."""

import numpy as np
import pytest
from sklearn.calibration import calibration_curve

from fervor_export.evaluation.reliability import reliability


def test_bins_by_hand():
    curve = reliability(np.array([0.05, 0.15, 0.15, 1.0]), np.array([0.05, 0.35, 0.15, 0.6]))
    assert [(entry.low, entry.clips) for entry in curve.bins] == [(0.0, 1), (0.1, 2), (0.9, 1)]
    assert curve.error == pytest.approx((0 + 2 * 0.1 + 0.4) / 4)


def test_the_curve_is_scikit_learns():
    random = np.random.default_rng(0)
    predicted = random.random(500)
    happened = random.random(500) < predicted**2
    observed, mean = calibration_curve(happened, predicted, n_bins=10)
    bins = reliability(predicted, happened.astype(float)).bins
    assert [entry.observed for entry in bins] == pytest.approx(observed, abs=1e-4)
    assert [entry.predicted for entry in bins] == pytest.approx(mean, abs=1e-4)


def test_nothing_has_no_error():
    assert reliability(np.empty(0), np.empty(0)).error is None
