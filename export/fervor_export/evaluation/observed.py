"""How soon estimates are worth something: agreement after the first one, two, three … seconds of each clip."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fervor.emotions import emotion_index
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.evaluation.estimator import Estimates, Reading
from fervor_export.evaluation.metrics import Figure, score

LONGEST_S = 10
"""Later points would be about a handful of clips."""


@dataclass(frozen=True, slots=True)
class Glance:
    """Agreement when only the beginning of each clip was seen."""

    seconds: float | None
    """None: whole clips."""
    r: Figure
    r_within: Figure
    whole: float
    """Share of the clips that were over by then."""


def by_seconds(
    clips: Sequence[Clip], estimates: Sequence[Estimates], reading: Reading, *, seed: int = 0
) -> tuple[Glance, ...]:
    """Agreement by seconds observed. Shorter clips count whole, so that every point is about the same clips."""
    durations = np.asarray([clip.seconds for clip in clips])
    last = min(LONGEST_S, math.ceil(float(np.percentile(durations, 90))))
    own = [values[:, emotion_index(clip.emotion)] for clip, values in zip(clips, estimates, strict=True)]
    glances = []
    for seconds in (*range(1, last + 1), None):
        stop = None if seconds is None else round(seconds * RATE_HZ)
        figures = score(np.asarray([reading.value(values[:stop]) for values in own]), clips, seed=seed)
        over = 1.0 if seconds is None else float((durations <= seconds).mean())
        glances.append(Glance(seconds, figures.r, figures.r_within, round(over, 4)))
    return tuple(glances)
