"""Reliability: whether clips that are said to be 0.7 are 0.7 on average."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

BINS = 10


@dataclass(frozen=True, slots=True)
class Bin:
    """Clips whose prediction lies between two tenths."""

    low: float
    high: float
    clips: int
    predicted: float
    """Mean prediction."""
    observed: float
    """Mean intensity."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """The calibration curve, bins without clips left out."""

    bins: tuple[Bin, ...]
    error: float | None
    """Expected calibration error: the mean of |predicted - observed| over bins, weighted by clips."""


def reliability(predicted: Floats, target: Floats, *, bins: int = BINS) -> Reliability:
    """The calibration curve of predictions [clip] in bins of equal width."""
    place = np.minimum((predicted * bins).astype(int), bins - 1)
    filled = []
    for index in np.unique(place).tolist():
        mine = place == index
        means = float(predicted[mine].mean()), float(target[mine].mean())
        filled.append(Bin(index / bins, (index + 1) / bins, int(mine.sum()), round(means[0], 4), round(means[1], 4)))
    off = [(entry.clips, abs(entry.predicted - entry.observed)) for entry in filled]
    error = sum(count * far for count, far in off) / len(predicted) if off else None
    return Reliability(tuple(filled), None if error is None else round(error, 4))
