"""The noise ceiling: how well anything could agree with labels that are shares of few observers.

An intensity is k of n answers. Its variance is that of the true share plus the panel's noise, mean of p(1-p)/n, which
mean of y(1-y)/(n-1) estimates without bias. So the largest correlation that any predictor can have with the labels is
the root of the share of their variance that is not noise.
"""

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def ceiling(intensity: Floats, observers: npt.NDArray[np.int64]) -> float | None:
    """The largest Pearson r with labels [clip] of so many observers [clip] each.

    Returns:
        0 to 1; None for fewer than three clips, labels without spread, or a panel of one.
    """
    if len(intensity) < 3 or observers.min() < 2:
        return None
    spread = float(intensity.var(ddof=1))
    if spread < 1e-12:
        return None
    noise = float((intensity * (1.0 - intensity) / (observers - 1)).mean())
    return math.sqrt(max(0.0, spread - noise) / spread)


def expected_ceiling(observers: int, concentration: float) -> float:
    """The ceiling if true shares follow a Beta distribution whose parameters add up to `concentration`.

    √(n / (n + a + b)): beta-binomial variance, law of total variance. Concentrations of 5 to 6 give the values that
    docs/reference/evaluation.md lists by n.
    """
    return math.sqrt(observers / (observers + concentration))
