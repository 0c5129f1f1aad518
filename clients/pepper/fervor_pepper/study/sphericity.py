"""Sphericity of repeated measures: whether differences between conditions vary alike, and how much a test owes to it.

Sources: Mauchly 1940 for W; Anderson 2003, section 10.7.4, for its distribution to second order, as SPSS and R have
it; Greenhouse & Geisser 1959 for epsilon. statsmodels has neither.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import helmert
from scipy.stats import chi2


@dataclass(frozen=True, slots=True)
class Sphericity:
    """Mauchly's test and the Greenhouse-Geisser epsilon. Two conditions are always spherical."""

    epsilon: float
    """1: spherical; 1 / (conditions - 1): as far from it as can be."""
    w: float | None = None
    chi2: float | None = None
    df: int | None = None
    p: float | None = None
    """None where the test can't be done: two conditions, or fewer participants than conditions."""

    @property
    def violated(self) -> bool:
        """Whether the test says no at 5 %."""
        return self.p is not None and self.p < 0.05


def sphericity(scores: npt.NDArray[np.float64]) -> Sphericity:
    """Sphericity of scores [participant, condition]."""
    participants, conditions = scores.shape
    contrasts = helmert(conditions)  # [condition - 1, condition], orthonormal
    spread = np.atleast_2d(contrasts @ np.cov(scores, rowvar=False) @ contrasts.T)
    d, n = conditions - 1, participants - 1
    if d == 1:
        return Sphericity(1.0)
    epsilon = float(np.trace(spread) ** 2 / (d * np.sum(spread**2)))
    w = float(np.linalg.det(spread) / (np.trace(spread) / d) ** d)
    if n < d or w <= 0.0:
        return Sphericity(epsilon)
    rho = 1.0 - (2 * d**2 + d + 2) / (6 * d * n)
    df = d * (d + 1) // 2 - 1
    statistic = -n * rho * np.log(w)
    second = (d + 2) * (d - 1) * (d - 2) * (2 * d**3 + 6 * d**2 + 3 * d + 2) / (288 * (n * d * rho) ** 2)
    first = chi2.sf(statistic, df)
    p = float(np.clip(first + second * (chi2.sf(statistic, df + 4) - first), 0.0, 1.0))
    return Sphericity(min(epsilon, 1.0), w, float(statistic), df, p)
