"""How much estimates and their agreement change when the same movement is seen otherwise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor_export.clip import Clip
from fervor_export.evaluation.disturbances import Disturbance, See, disturbances
from fervor_export.evaluation.estimator import Estimates, Estimator, Motion, Reading
from fervor_export.evaluation.metrics import rounded, within_emotions

Floats = npt.NDArray[np.float64]

EXACT = 1e-5
"""What rounding may change."""

MOST_CLIPS = 200
"""Asked of so many clips, drawn by seed: the change of a prediction is seen on a few dozen."""


@dataclass(frozen=True, slots=True)
class Change:
    """What one disturbance does to the predictions of clips under their emotions."""

    name: str
    title: str
    clips: int
    mean: float
    """Mean absolute change."""
    most: float
    """Largest absolute change."""
    r_before: float | None
    """Within emotions, of the same clips undisturbed."""
    r_after: float | None
    promised: bool
    """Whether no change beyond `EXACT` is promised."""
    kept: bool
    """Whether there was none."""


def invariance(
    judged: Sequence[tuple[Estimator, Sequence[Clip]]],
    reading: Reading,
    *,
    most: int = MOST_CLIPS,
    seed: int = 0,
    tell: Callable[[], None] = lambda: None,
) -> tuple[Change, ...]:
    """Changes by every disturbance.

    Args:
        judged: estimators, each with clips that it has not learned from.
        reading: how a clip's estimates become one number.
        most: clips asked about.
        seed: which clips, and which frames are lost.
        tell: called after each disturbance.
    """
    judged = _some(judged, most, seed)
    clips = [clip for _, some in judged for clip in some]
    seen: dict[See | None, Floats] = {}
    changes = []
    for disturbance in disturbances():
        if disturbance.against not in seen:
            seen[disturbance.against] = _values(judged, reading, disturbance.against, seed)
        before, after = seen[disturbance.against], _values(judged, reading, disturbance.apply, seed)
        changes.append(_change(disturbance, before, after, clips))
        tell()
    return tuple(changes)


def _change(disturbance: Disturbance, before: Floats, after: Floats, clips: Sequence[Clip]) -> Change:
    apart = np.abs(after - before)
    return Change(
        name=disturbance.name,
        title=disturbance.title,
        clips=len(clips),
        mean=float(f"{apart.mean():.2g}"),
        most=float(f"{apart.max():.2g}"),
        r_before=rounded(within_emotions(before, clips)),
        r_after=rounded(within_emotions(after, clips)),
        promised=disturbance.exact,
        kept=bool(apart.max() <= EXACT),
    )


def _values(
    judged: Sequence[tuple[Estimator, Sequence[Clip]]],
    reading: Reading,
    see: See | None,
    seed: int,
) -> Floats:
    """Predictions [clip] of clips as they are seen."""
    random = np.random.default_rng(seed)
    values = []
    for estimator, clips in judged:
        motions = [Motion.of(clip) if see is None else see(Motion.of(clip), random) for clip in clips]
        estimates: list[Estimates] = estimator.estimate(motions)
        values.append(reading.labelled(clips, estimates))
    return np.concatenate(values)


def _some(
    judged: Sequence[tuple[Estimator, Sequence[Clip]]], most: int, seed: int
) -> list[tuple[Estimator, Sequence[Clip]]]:
    """The same share of every estimator's clips, `most` in all."""
    total = sum(len(clips) for _, clips in judged)
    if total <= most:
        return [(estimator, clips) for estimator, clips in judged if clips]
    chosen = set(np.random.default_rng(seed).permutation(total)[:most].tolist())
    some: list[tuple[Estimator, Sequence[Clip]]] = []
    first = 0
    for estimator, clips in judged:
        kept = [clip for place, clip in enumerate(clips, start=first) if place in chosen]
        some += [(estimator, kept)] if kept else []
        first += len(clips)
    return some
