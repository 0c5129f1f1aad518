"""Protocols: who is learned from, who is judged, and what everybody says of clips that they have not learned from.

For each fold the network, the baseline (with and without the emotion) and the controls learn from the same training
clips and judge the same others. Whatever is chosen on the way (the best epoch, the baseline's settings) is chosen
inside the training clips. What a network is trained on is checked against what it judges, augmented copies included.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fervor_export.clip import Clip, digest
from fervor_export.evaluation import baseline, controls
from fervor_export.evaluation.estimator import Estimates, Estimator, Motion, NetworkEstimator, Reading
from fervor_export.evaluation.remembered import remembered
from fervor_export.evaluation.splits import Fold, Split, Unit, assert_disjoint
from fervor_export.recipe import Recipe
from fervor_export.training import Epoch, copies, sides, train
from fervor_export.training_state import identity, name_of

Floats = npt.NDArray[np.float64]
Augment = Callable[[Sequence[Clip]], Sequence[Clip]]
Tell = Callable[[str, int], None]
Learn = Callable[[Sequence[Clip], Sequence[Clip], Unit, float | None], "Learned"]
"""Trains on clips; told also the clips that will be judged, what no fold has on both sides, and the minutes."""

NETWORK, BASELINE, EMOTION_MEAN = "network", "baseline", "emotion_mean"

PREDICTORS = {
    NETWORK: "network (LSTM)",
    BASELINE: "baseline (SVM)",
    "baseline_no_emotion": "baseline, no emotion",
    EMOTION_MEAN: "emotion mean",
    "speed": "joint speed",
    "speed_by_emotion": "joint speed by emotion",
    "network_wrong_emotion": "network, wrong emotion",
    "network_no_emotion": "network, no emotion",
}
"""Everybody who predicts, in the order of the report."""


@dataclass(frozen=True, slots=True)
class FoldTraining:
    """How the network of one fold was come by."""

    train_clips: int
    """Augmented copies not counted."""
    test_clips: int
    epochs: int
    best_epoch: int
    stopped: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Learned:
    """A network that learned, and how."""

    estimator: Estimator
    epochs: int = 0
    best_epoch: int = 0
    stopped: str = "not trained here"
    seconds: float = 0.0
    """Of training, interruptions left out."""


@dataclass(frozen=True, slots=True)
class Learner:
    """How a fold's network learns."""

    recipe: Recipe
    seed: int = 0
    on_epoch: Callable[[Epoch], None] = lambda _: None
    augment: Augment | None = None
    """Makes copies instead of the recipe; given the clips that are learned from, and no others."""
    keep: Path | None = None
    """Folder of trainings under way and done, each under a name of its own: what is there is gone on with."""

    def learn(self, clips: Sequence[Clip], test: Sequence[Clip], unit: Unit, minutes: float | None) -> Learned:
        """Train on clips; a fifth of their actors are kept for choosing the epoch, if the recipe chooses.

        Raises:
            DataError: too few actors, or a leak.
        """
        learn, validate = sides(clips, self.recipe, seed=self.seed)
        made = self.augment(learn) if self.augment else copies(learn, self.recipe)
        assert_disjoint([*made, *validate], test, unit=unit)
        state = None
        if self.keep is not None:
            state = self.keep / f"{name_of(identity(made, validate, self.recipe, seed=self.seed))}.pt"
        result = train(
            made, validate, self.recipe, seed=self.seed, max_minutes=minutes, state=state, on_epoch=self.on_epoch
        )
        return Learned(
            NetworkEstimator(result.network),
            len(result.history),
            result.kept.number,
            result.stopped,
            result.history[-1].seconds,
        )


@dataclass(slots=True)
class Budget:
    """Minutes of training, shared evenly by the trainings that are still to come."""

    minutes: float | None
    trainings: int
    started: float = field(default_factory=time.monotonic)

    def next(self) -> float | None:
        """Minutes of the next training; None without a limit."""
        if self.minutes is None:
            return None
        left = max(0.0, self.minutes - (time.monotonic() - self.started) / 60.0)
        self.trainings -= 1
        return left / max(self.trainings + 1, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What came of a protocol: predictions of all judged clips by those who had not learned from them."""

    clips: tuple[Clip, ...]
    folds: npt.NDArray[np.intp]  # [clip] in which fold it was judged
    unit: Unit
    predictions: dict[str, Floats]
    """By name of `PREDICTORS`, [clip]."""
    estimates: tuple[Estimates, ...]
    """The network's, per clip [frame, 12]."""
    judged: tuple[tuple[Estimator, tuple[Clip, ...]], ...]
    """Each fold's network with the clips that it judged."""
    trainings: tuple[FoldTraining, ...]
    reading: Reading


def run(
    clips: Sequence[Clip],
    split: Split,
    learn: Learn,
    reading: Reading,
    *,
    handcrafted: Floats | None,
    grid: baseline.Grid = baseline.GRID,
    keep: Path | None = None,
    budget: Budget | None = None,
    seed: int = 0,
    tell: Tell = lambda _what, _fold: None,
) -> Run:
    """Run a protocol.

    Args:
        clips: the data set, not augmented.
        split: its folds.
        learn: how the network of a fold is come by.
        reading: how a clip's estimates become one number.
        handcrafted: features [clip, feature] of the clips; None for the network alone, without baseline and controls.
        grid: the baseline's settings.
        keep: folder in which the baseline's predictions are kept, so that they are made once.
        budget: of training.
        seed: of the wrong emotions.
        tell: told what begins, and how many folds are done.

    Raises:
        DataError: too few actors to choose an epoch by, or a leak.
    """
    predictions = {name: np.full(len(clips), np.nan) for name in PREDICTORS}
    folds, estimates = np.zeros(len(clips), np.intp), [np.empty((0, 12), np.float32)] * len(clips)
    judged, trainings = [], []
    for number, fold in enumerate(split):
        parts = [clips[index] for index in fold.train], [clips[index] for index in fold.test]
        assert_disjoint(*parts, unit=split.unit)
        tell(f"fold {number + 1} of {len(split)}, network", number)
        learned = learn(*parts, split.unit, budget.next() if budget else None)
        trainings.append(_training(learned, parts))
        answers = learned.estimator.estimate([Motion.of(clip) for clip in parts[1]])
        tell(f"fold {number + 1} of {len(split)}, baseline", number)
        said = _of_network(parts[1], answers, reading, seed + number)
        if handcrafted is not None:
            said |= _of_others(parts, fold, handcrafted, grid, keep)
        for name, values in said.items():
            predictions[name][list(fold.test)] = values
        for index, answer in zip(fold.test, answers, strict=True):
            folds[index], estimates[index] = number, answer
        judged.append((learned.estimator, tuple(parts[1])))
    rows = sorted(index for fold in split for index in fold.test)
    return Run(
        clips=tuple(clips[row] for row in rows),
        folds=folds[rows],
        unit=split.unit,
        predictions={name: values[rows] for name, values in predictions.items()},
        estimates=tuple(estimates[row] for row in rows),
        judged=tuple(judged),
        trainings=tuple(trainings),
        reading=reading,
    )


def _training(learned: Learned, parts: tuple[list[Clip], list[Clip]]) -> FoldTraining:
    seconds = round(learned.seconds, 1)
    return FoldTraining(len(parts[0]), len(parts[1]), learned.epochs, learned.best_epoch, learned.stopped, seconds)


def _of_network(test: Sequence[Clip], estimates: Sequence[Estimates], reading: Reading, seed: int) -> dict[str, Floats]:
    """What the network says under the clips' emotion, under another and under none."""
    wrong = controls.other_emotions(test, seed=seed)
    said = {NETWORK: reading.labelled(test, estimates), "network_no_emotion": reading.unlabelled(estimates)}
    return said if wrong is None else said | {"network_wrong_emotion": reading.under(wrong, estimates)}


def _of_others(
    sides: tuple[list[Clip], list[Clip]], fold: Fold, handcrafted: Floats, grid: baseline.Grid, keep: Path | None
) -> dict[str, Floats]:
    """What the baseline and the controls say."""
    features = handcrafted[list(fold.train)], handcrafted[list(fold.test)]
    causes = (*map(digest, sides), *features, grid) if keep else ()
    return remembered(keep, causes, lambda: _fit_others(sides, features, grid))


def _fit_others(
    sides: tuple[list[Clip], list[Clip]], features: tuple[Floats, Floats], grid: baseline.Grid
) -> dict[str, Floats]:
    train_clips, test = sides
    said = {
        EMOTION_MEAN: controls.emotion_mean(train_clips, test),
        "speed": controls.mean_speed(train_clips, test),
        "speed_by_emotion": controls.mean_speed_by_emotion(train_clips, test),
    }
    for name, told in ((BASELINE, True), ("baseline_no_emotion", False)):
        fitted = baseline.fit(features[0], train_clips, with_emotion=told, grid=grid)
        said[name] = baseline.predict(fitted, features[1], test, with_emotion=told)
    return said
