"""The noise ceiling, against simulation."""

import numpy as np
import pytest

from fervor_export.evaluation.ceiling import ceiling, expected_ceiling

TABLE = {5: (0.67, 0.71), 8: (0.76, 0.79), 10: (0.79, 0.82), 13: (0.83, 0.85), 20: (0.88, 0.89)}
"""Observers: largest r of any predictor, for a range of Beta priors (docs/reference/evaluation.md)."""


@pytest.mark.parametrize("observers", TABLE)
def test_the_table_by_simulation_and_by_formula(observers):
    random = np.random.default_rng(observers)
    for concentration, expected in zip((6.0, 4.9), TABLE[observers], strict=True):
        share = random.beta(0.45 * concentration, 0.55 * concentration, 200_000)
        label = random.binomial(observers, share) / observers
        simulated = np.corrcoef(share, label)[0, 1]
        assert simulated == pytest.approx(expected, abs=0.01)
        assert expected_ceiling(observers, concentration) == pytest.approx(simulated, abs=0.005)
        assert ceiling(label, np.full(len(label), observers)) == pytest.approx(simulated, abs=0.005)


def test_panels_of_different_sizes():
    random = np.random.default_rng(0)
    observers = random.integers(5, 20, 200_000)
    share = random.beta(2, 3, 200_000)
    label = random.binomial(observers, share) / observers
    assert ceiling(label, observers) == pytest.approx(np.corrcoef(share, label)[0, 1], abs=0.005)


def test_labels_that_are_all_noise_or_say_nothing():
    random = np.random.default_rng(0)
    label = random.binomial(8, 0.5, 50_000) / 8
    assert ceiling(label, np.full(50_000, 8)) == pytest.approx(0.0, abs=0.1)
    assert ceiling(np.full(9, 0.4), np.full(9, 10)) is None
    assert ceiling(np.array([0.0, 1.0, 1.0]), np.array([1, 1, 1])) is None
    assert ceiling(np.array([0.2, 0.4]), np.array([5, 5])) is None
