"""How well predictions fit intensities: MAE, Pearson r pooled and within emotion, CCC."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Scores:
    """Agreement of predictions with targets, one value of each per clip."""

    mae: float
    r: float
    """Pearson's, all clips pooled, as in the paper."""
    r_within: float
    """Mean of Pearson's r over emotions, weighted by clips: what is left when knowing the emotion gives nothing."""
    ccc: float
    """Lin's concordance: r, lowered by differences in mean and spread."""
    spread: float
    """Standard deviation of the predictions over that of the targets."""

    def as_dict(self, prefix: str = "") -> dict[str, float]:
        """Names and values, rounded to four digits."""
        names = ("mae", "r", "r_within", "ccc", "spread")
        return {prefix + name: round(getattr(self, name), 4) for name in names}


def score(predicted: Floats, target: Floats, emotions: Sequence[str]) -> Scores:
    """Compare predictions [clip] with targets [clip] of clips whose emotions are given."""
    return Scores(
        mae=float(np.abs(predicted - target).mean()),
        r=pearson(predicted, target),
        r_within=_pearson_within(predicted, target, np.asarray(emotions)),
        ccc=concordance(predicted, target),
        spread=float(predicted.std() / max(target.std(), 1e-12)),
    )


def pearson(predicted: Floats, target: Floats) -> float:
    """Pearson's correlation; 0 where either side is constant."""
    a, b = predicted - predicted.mean(), target - target.mean()
    scale = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / scale if scale > 1e-12 else 0.0


def concordance(predicted: Floats, target: Floats) -> float:
    """Lin's concordance correlation coefficient; 0 where both sides are constant."""
    covariance = float(((predicted - predicted.mean()) * (target - target.mean())).mean())
    scale = float(predicted.var() + target.var() + (predicted.mean() - target.mean()) ** 2)
    return 2.0 * covariance / scale if scale > 1e-12 else 0.0


def _pearson_within(predicted: Floats, target: Floats, emotions: npt.NDArray[np.str_]) -> float:
    """Over emotions with at least three clips; 0 where there is none."""
    groups = [emotions == emotion for emotion in np.unique(emotions) if (emotions == emotion).sum() >= 3]
    if not groups:
        return 0.0
    weights = [int(group.sum()) for group in groups]
    return float(np.average([pearson(predicted[group], target[group]) for group in groups], weights=weights))
