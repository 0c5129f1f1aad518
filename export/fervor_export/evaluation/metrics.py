"""Agreement of predictions with intensities, with actor-level bootstrap intervals.

Rules. A number that is not defined is None, never 0 and never nan: no correlation is known of a constant. Neutral is
apart: how many see nothing in particular is no intensity, so it is in `r_all` and nowhere else. Within-emotion r is
Fisher's mean over emotions, because a predictor that only knows the emotion can look good in pooled r.

Everything follows from sums per actor and emotion, so a bootstrap over actors is a matrix product. Intervals are
percentiles 2.5 and 97.5 of resampled actors: clips of one actor are not independent, and resampling clips would make
intervals several times too narrow. Formulas: docs/reference/evaluation.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS, emotion_index
from fervor_export.clip import Clip

Floats = npt.NDArray[np.float64]

NEUTRAL = emotion_index("neutral")

RESAMPLES = 1000

LEAST_CLIPS = 4
"""Clips of an emotion for a correlation: Fisher's z has the variance 1 / (n - 3)."""

SMALLEST_VARIANCE = 1e-9
"""Below it predictions or labels count as constant."""

MOST_R = 1.0 - 1e-9
"""Fisher's z of 1 is infinite."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A number with its 95 % interval; None where it is not defined."""

    value: float | None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class Scores:
    """How well one predictor does, neutral apart."""

    clips: int
    r_all: Figure
    """Pearson's, all clips pooled, neutral among them: the paper's number."""
    r: Figure
    """Pearson's, pooled, without neutral."""
    r_within: Figure
    """Pearson's within emotions, Fisher's mean over them."""
    ccc: Figure
    """Lin's concordance, pooled, without neutral."""
    mae: Figure
    """Mean absolute error, without neutral."""
    spread: Figure
    """Standard deviation of the predictions over that of the intensities, without neutral."""
    emotions: dict[str, Figure]
    """Pearson's within each emotion of the data, neutral among them."""
    emotions_counted: int
    """How many emotions are in `r_within`."""


NUMBERS = ("r_all", "r", "r_within", "ccc", "mae", "spread")
"""The figures of `Scores` that are one number."""


def score(
    predicted: Floats,
    clips: Sequence[Clip],
    *,
    folds: npt.NDArray[np.intp] | None = None,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Scores:
    """Score predictions [clip].

    Args:
        predicted: one number a clip; not finite where there is none, and then the clip does not count.
        clips: what they are of.
        folds: [clip] in which fold each was judged. An emotion whose predictions are constant within every fold has
            no correlation: means of folds differ from each other, and in the wrong direction.
        resamples: of the actors.
        seed: of the resampling.
    """
    sums, constant = _sums(predicted, clips, folds)
    values = _numbers(sums.sum(0)[None], constant)
    drawn = _numbers(_resampled(sums, resamples, seed), constant) if len(sums) > 1 and resamples else None
    figures = {name: _figure(value, None if drawn is None else drawn[name]) for name, value in values.items()}
    present = [emotion for index, emotion in enumerate(EMOTIONS) if sums[:, index, 0].sum() > 0]
    return Scores(
        clips=int(sums[..., 0].sum()),
        **{name: figures[name] for name in NUMBERS},
        emotions={emotion: figures[emotion] for emotion in present},
        emotions_counted=sum(figures[emotion].value is not None for emotion in present if emotion != "neutral"),
    )


def difference(
    one: Floats,
    other: Floats,
    clips: Sequence[Clip],
    *,
    number: str = "r_within",
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Figure:
    """How much better one predictor is than another by a number, both on the same resampled actors."""
    pairs = [_sums(predicted, clips, None) for predicted in (one, other)]
    value = np.subtract(*(_numbers(sums.sum(0)[None], constant)[number] for sums, constant in pairs))
    if len(pairs[0][0]) < 2:
        return _figure(value, None)
    drawn = (_numbers(_resampled(sums, resamples, seed), constant)[number] for sums, constant in pairs)
    return _figure(value, np.subtract(*drawn))


def pearson(predicted: Floats, target: Floats) -> float | None:
    """Pearson's correlation of two series; None where either is constant or there are fewer than three."""
    if len(predicted) < 3 or min(predicted.var(), target.var()) < SMALLEST_VARIANCE:
        return None
    return float(np.corrcoef(predicted, target)[0, 1])


def within_emotions(predicted: Floats, clips: Sequence[Clip]) -> float | None:
    """Fisher's mean of Pearson's r within emotions, neutral apart."""
    return score(predicted, clips, resamples=0).r_within.value


def rounded(value: float | None) -> float | None:
    """Four digits are more than the data hold."""
    return None if value is None or not np.isfinite(value) else round(float(value), 4)


# --- from sums -------------------------------------------------------------------------------------------------------

_N, _P, _T, _PP, _TT, _PT, _ABS = range(7)


def _sums(
    predicted: Floats, clips: Sequence[Clip], folds: npt.NDArray[np.intp] | None
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Sums [actor, emotion, 7] of 1, p, t, p², t², pt, |p - t|, and which emotions' predictions are constant [11].

    p and t are taken from one half, in the middle of their range, so that little is lost in the differences later.
    """
    target = np.asarray([clip.intensity for clip in clips])
    emotion = np.asarray([emotion_index(clip.emotion) for clip in clips])
    _, actor = np.unique([clip.actor for clip in clips], return_inverse=True)
    known = np.isfinite(predicted)
    p, t = np.where(known, predicted, 0.0) - 0.5, target - 0.5
    columns = np.stack([np.ones(len(p)), p, t, p * p, t * t, p * t, np.abs(p - t)], axis=1) * known[:, None]
    sums = np.zeros((actor.max(initial=-1) + 1, len(EMOTIONS), columns.shape[1]))
    np.add.at(sums, (actor, emotion), columns)
    return sums, _constant(np.where(known, predicted, np.nan), emotion, folds)


def _constant(
    predicted: Floats, emotion: npt.NDArray[np.intp], folds: npt.NDArray[np.intp] | None
) -> npt.NDArray[np.bool_]:
    """Emotions [11] of which every fold's predictions are all alike."""
    place = np.zeros(len(emotion), int) if folds is None else folds
    varies = np.zeros(len(EMOTIONS), bool)
    for index in range(len(EMOTIONS)):
        mine = (emotion == index) & np.isfinite(predicted)
        parts = (predicted[mine & (place == fold)] for fold in np.unique(place[mine]))
        varies[index] = any(part.var() >= SMALLEST_VARIANCE for part in parts)
    return ~varies


def _resampled(sums: Floats, resamples: int, seed: int) -> Floats:
    """Sums [resample, emotion, 7] of actors drawn with replacement."""
    actors = len(sums)
    drawn = np.random.default_rng(seed).multinomial(actors, np.full(actors, 1.0 / actors), size=resamples)
    resampled: Floats = np.einsum("ra,aes->res", drawn.astype(np.float64), sums)
    return resampled


def _numbers(sums: Floats, constant: npt.NDArray[np.bool_]) -> dict[str, Floats]:
    """Every number [resample] of sums [resample, emotion, 7]; nan where it is not defined."""
    by_emotion = _pearson(sums)  # [resample, emotion]
    by_emotion[:, constant] = np.nan
    by_emotion[sums[..., _N] < LEAST_CLIPS] = np.nan
    felt = np.delete(sums, NEUTRAL, axis=1).sum(1)  # [resample, 7]
    everything = sums.sum(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        numbers = {
            "r_all": _pearson(everything),
            "r": _pearson(felt),
            "r_within": _fisher(np.delete(by_emotion, NEUTRAL, 1), np.delete(sums[..., _N], NEUTRAL, 1)),
            "ccc": _concordance(felt),
            "mae": felt[..., _ABS] / felt[..., _N],
            "spread": _spread(felt),
        }
    return numbers | {emotion: by_emotion[:, index] for index, emotion in enumerate(EMOTIONS)}


def _moments(sums: Floats) -> tuple[Floats, Floats, Floats]:
    """Variances of p and t, and their covariance; nan where there is nothing."""
    count = np.where(sums[..., _N] > 0, sums[..., _N], np.nan)
    p, t = sums[..., _P] / count, sums[..., _T] / count
    return sums[..., _PP] / count - p * p, sums[..., _TT] / count - t * t, sums[..., _PT] / count - p * t


def _pearson(sums: Floats) -> Floats:
    of_p, of_t, both = _moments(sums)
    sound = (of_p >= SMALLEST_VARIANCE) & (of_t >= SMALLEST_VARIANCE) & (sums[..., _N] >= 3)
    r = both / np.sqrt(np.where(sound, of_p * of_t, np.nan))
    clipped: Floats = np.clip(r, -1.0, 1.0)
    return clipped


def _concordance(sums: Floats) -> Floats:
    of_p, of_t, both = _moments(sums)
    apart = (sums[..., _P] - sums[..., _T]) / sums[..., _N]
    scale = of_p + of_t + apart * apart
    ccc: Floats = 2.0 * both / np.where(scale >= SMALLEST_VARIANCE, scale, np.nan)
    return ccc


def _spread(sums: Floats) -> Floats:
    of_p, of_t, _ = _moments(sums)
    spread: Floats = np.sqrt(np.maximum(of_p, 0.0) / np.where(of_t >= SMALLEST_VARIANCE, of_t, np.nan))
    return spread


def _fisher(r: Floats, clips: Floats) -> Floats:
    """Tanh of the mean of atanh r, weighted by n - 3, over the last axis."""
    known = np.isfinite(r)
    weight = np.where(known, clips - 3.0, 0.0)
    z = np.arctanh(np.clip(np.where(known, r, 0.0), -MOST_R, MOST_R))
    total = weight.sum(-1)
    mean: Floats = np.tanh((weight * z).sum(-1) / np.where(total > 0, total, np.nan))
    return mean


def _figure(value: Floats, drawn: Floats | None) -> Figure:
    """A number [1] with the percentiles of its resamples; no interval where most of them are not defined."""
    if not np.isfinite(value[0]):
        return Figure(None)
    sound = np.empty(0) if drawn is None else drawn[np.isfinite(drawn)]
    if drawn is None or len(sound) < max(0.5 * len(drawn), 20):
        return Figure(rounded(value[0]))
    low, high = np.percentile(sound, (2.5, 97.5))
    return Figure(rounded(value[0]), rounded(low), rounded(high))
