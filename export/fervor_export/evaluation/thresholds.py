"""Thresholds between weak and strong, from predictions of clips that were not learned from.

The rule. A clip is truly strong if its intensity is at least the median of its emotion's clips. The threshold of an
emotion is the prediction that tells its weak from its strong clips with the best balanced accuracy: the middle of the
best interval between two neighbouring predictions, the one nearest to the median prediction where several are equally
good. Only the middle part of the predictions is searched, `LEAST_SHARE` to either side left out: a network that tells
nothing apart would else be best served by an extreme, and a robot would never see one of the levels. An emotion with
fewer than `LEAST_EACH` clips on either side has the common threshold, found in the same way over all emotions together;
`unknown` is found so too, from predictions without a label. Neutral has its own, though what it parts is no intensity.

Balanced accuracy of thresholds on the clips they were chosen by flatters them. `levels` therefore chooses them anew for
each fold, from the other folds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor.metadata import LevelRule
from fervor_export.clip import Clip

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

LEAST_EACH = 8
"""Weak clips, and strong ones, that an emotion needs for a threshold of its own."""

LEAST_SHARE = 0.2
"""Of an emotion's predictions, that lie at least on either side of its threshold."""

MIDDLE = 0.5
"""Where nothing can be told apart."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What goes into a model file, and how it was come by."""

    rule: LevelRule
    own: tuple[str, ...]
    """Emotions with a threshold of their own; the others have the common one."""
    boundary: dict[str, float]
    """The true intensity from which a clip of an emotion counts as strong: its median."""


@dataclass(frozen=True, slots=True)
class Confusion:
    """Clips by true and predicted level."""

    weak_as_weak: int
    weak_as_strong: int
    strong_as_weak: int
    strong_as_strong: int

    @property
    def balanced_accuracy(self) -> float | None:
        """Mean of the shares of weak and of strong clips that are told right; None where there are none of a kind."""
        weak, strong = self.weak_as_weak + self.weak_as_strong, self.strong_as_weak + self.strong_as_strong
        if not weak or not strong:
            return None
        return round(0.5 * (self.weak_as_weak / weak + self.strong_as_strong / strong), 4)


@dataclass(frozen=True, slots=True)
class Levels:
    """How well weak is told from strong, thresholds chosen in other folds; neutral apart."""

    all: Confusion
    balanced_accuracy: float | None
    emotions: dict[str, float | None]
    """Balanced accuracy within each emotion."""


def choose_thresholds(clips: Sequence[Clip], labelled: Floats, unlabelled: Floats) -> Thresholds:
    """The level rule for a model file.

    Args:
        clips: with known intensities, none of them learned from by what predicted them.
        labelled: [clip] predictions under the clips' emotions.
        unlabelled: [clip] predictions under no emotion.
    """
    emotions, strong, boundary = _true_levels(clips)
    felt = emotions != "neutral"
    common = _best(labelled[felt], strong[felt], MIDDLE)
    threshold, own = {}, []
    for emotion in EMOTIONS:
        mine = emotions == emotion
        enough = min(int(strong[mine].sum()), int((~strong[mine]).sum())) >= LEAST_EACH
        threshold[emotion] = _best(labelled[mine], strong[mine], common) if enough else common
        own += [emotion] * enough
    threshold[UNKNOWN] = _best(unlabelled[felt], strong[felt], common)
    rule = LevelRule(threshold={name: round(value, 3) for name, value in threshold.items()})
    return Thresholds(rule, tuple(own), boundary)


def levels(clips: Sequence[Clip], labelled: Floats, folds: npt.NDArray[np.intp]) -> Levels:
    """Levels told by thresholds and boundaries from the other folds; of a single fold, from the other fifths."""
    if len(np.unique(folds)) < 2:
        folds = np.arange(len(clips)) % 5
    told, true = np.zeros(len(clips), bool), np.zeros(len(clips), bool)
    for fold in np.unique(folds):
        here = folds == fold
        others = [clip for clip, mine in zip(clips, here, strict=True) if not mine]
        chosen = choose_thresholds(others, labelled[~here], labelled[~here])
        halves = float(np.median([clip.intensity for clip in others])) if others else MIDDLE
        for index in np.flatnonzero(here).tolist():
            emotion = clips[index].emotion
            told[index] = labelled[index] >= chosen.rule.threshold[emotion]
            true[index] = clips[index].intensity >= chosen.boundary.get(emotion, halves)
    emotions = np.asarray([clip.emotion for clip in clips])
    everything = confusion(true[emotions != "neutral"], told[emotions != "neutral"])
    return Levels(
        everything,
        everything.balanced_accuracy,
        {
            emotion: confusion(true[emotions == emotion], told[emotions == emotion]).balanced_accuracy
            for emotion in EMOTIONS
            if (emotions == emotion).any()
        },
    )


def confusion(true: Mask, told: Mask) -> Confusion:
    """Counts of levels [clip], True where strong."""
    return Confusion(
        int((~true & ~told).sum()), int((~true & told).sum()), int((true & ~told).sum()), int((true & told).sum())
    )


def _true_levels(clips: Sequence[Clip]) -> tuple[npt.NDArray[np.str_], Mask, dict[str, float]]:
    """Emotion and true level [clip], and the boundary of each emotion that is there."""
    emotions = np.asarray([clip.emotion for clip in clips], dtype=np.str_)
    target = np.asarray([clip.intensity for clip in clips])
    boundary = {emotion: float(np.median(target[emotions == emotion])) for emotion in np.unique(emotions).tolist()}
    strong = np.asarray([clip.intensity >= boundary[clip.emotion] for clip in clips], dtype=bool)
    return emotions, strong, boundary


def _best(predicted: Floats, strong: Mask, fallback: float) -> float:
    """The threshold with the best balanced accuracy; the fallback where all is of one level or all alike."""
    values = np.unique(predicted)
    if len(values) < 2 or strong.all() or not strong.any():
        return fallback
    between = 0.5 * (values[1:] + values[:-1])
    low, high = np.quantile(predicted, (LEAST_SHARE, 1.0 - LEAST_SHARE))
    inside = (between >= low) & (between <= high)
    if not inside.any():
        return float(np.median(predicted))
    between = between[inside]
    order = np.sort(predicted[strong]), np.sort(predicted[~strong])
    hits = 1.0 - np.searchsorted(order[0], between) / len(order[0])
    rejected = np.searchsorted(order[1], between) / len(order[1])
    accuracy = hits + rejected
    best = between[accuracy >= accuracy.max() - 1e-12]
    return float(best[np.abs(best - np.median(predicted)).argmin()])
