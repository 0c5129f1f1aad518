"""What clips that were not learned from say of a network: scores, and the thresholds between weak and strong.

Two ways. `held_out`: this network's predictions of clips kept from it. `out_of_fold`: predictions by the networks of
folds, trained by the same recipe on the rest of the same clips; they judge every clip, and the network that learns from
all of them afterwards has nobody left to judge it. The model file says which it was.
"""

from dataclasses import dataclass

import numpy as np

from fervor.metadata import LevelRule
from fervor_export.evaluation import metrics
from fervor_export.evaluation.protocols import NETWORK, Run
from fervor_export.evaluation.thresholds import choose_thresholds
from fervor_export.material import Material
from fervor_export.prediction import fit, predict
from fervor_export.recipe import Recipe
from fervor_export.training import TrainingResult


@dataclass(frozen=True, slots=True)
class Judgement:
    """For the model file and its card."""

    levels: LevelRule
    scores: dict[str, float]
    """By name, with what they are of before it: `test_r`."""


def held_out(result: TrainingResult, material: Material, recipe: Recipe) -> Judgement:
    """Judge a network by the clips of its material that it has not learned from, neutral apart in the scores.

    Validation clips have chosen the epoch, so their scores are a little flattering; thresholds hardly depend on that,
    and gain by every clip.
    """
    test, clips = material.test, [*material.test, *material.validate]
    predictions = predict(result.network, clips, recipe)
    chosen = choose_thresholds(clips, predictions.labelled, predictions.unlabelled)
    actors = len({clip.actor for clip in clips})
    source = f"{len(clips)} clips of {actors} held-out actor{'s' if actors != 1 else ''}"
    scores = fit(test, predict(result.network, test, recipe)).as_dict("test_")
    if result.kept.validation is not None:
        scores |= result.kept.validation.as_dict("validation_")
    return Judgement(chosen.rule.model_copy(update={"source": source}), scores)


def out_of_fold(runs: dict[str, Run]) -> Judgement:
    """Judge a recipe by the predictions of its folds.

    Args:
        runs: protocols by name; scores are of all of them, thresholds of the last.
    """
    last = list(runs.values())[-1]
    chosen = choose_thresholds(last.clips, last.predictions[NETWORK], last.predictions["network_no_emotion"])
    folds = len(np.unique(last.folds))
    source = (
        f"out-of-fold predictions of {len(last.clips)} clips, {folds} fold{'s' if folds != 1 else ''} by {last.unit}"
    )
    scores = {}
    for name, run in runs.items():
        found = metrics.score(run.predictions[NETWORK], run.clips, folds=run.folds, resamples=0)
        for number in metrics.NUMBERS:
            value = getattr(found, number).value
            if value is not None:
                scores[f"{name}_{number}"] = value
    return Judgement(chosen.rule.model_copy(update={"source": source}), scores)
