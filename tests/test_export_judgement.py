"""Scores and thresholds for a model file come from clips that were not learned from."""

from dataclasses import replace

import numpy as np
import pytest

from fervor_export.evaluation.estimator import Reading
from fervor_export.evaluation.protocols import NETWORK, Learner, run
from fervor_export.evaluation.splits import by_actor
from fervor_export.evaluation.thresholds import choose_thresholds
from fervor_export.judgement import held_out, out_of_fold
from fervor_export.material import Material
from fervor_export.prediction import fit, predict
from fervor_export.recipe import DEFAULT
from fervor_export.training import split_by_actor, train
from networks import waving_clips

RECIPE = replace(DEFAULT, epochs=2, batch_size=16)
CLIPS = [replace(clip, emotion=("joy", "anger", "neutral")[index % 3]) for index, clip in enumerate(waving_clips(72))]


def test_held_out_clips_judge_a_network():
    rest, test = split_by_actor(CLIPS, seed=1)
    learn, validate = split_by_actor(rest, seed=1)
    result = train(learn, validate, RECIPE)
    judged = held_out(result, Material("waves", "demo", CLIPS, learn, validate, test), RECIPE)
    kept = [*test, *validate]
    predictions = predict(result.network, kept, RECIPE)
    expected = choose_thresholds(kept, predictions.labelled, predictions.unlabelled)
    assert judged.levels.threshold == expected.rule.threshold
    assert judged.levels.source == f"{len(kept)} clips of 2 held-out actors"
    assert judged.scores["test_r"] == fit(test, predict(result.network, test, RECIPE)).as_dict()["r"]
    assert judged.scores["validation_mae"] == result.kept.validation.as_dict()["mae"]


def test_folds_judge_a_recipe():
    split = by_actor(CLIPS, most=3)
    folds = run(CLIPS, split, Learner(RECIPE).learn, Reading.of(RECIPE), handcrafted=None)
    judged = out_of_fold({"actors": folds})
    assert judged.levels.source == "out-of-fold predictions of 72 clips, 3 folds by actor"
    felt = np.asarray([clip.emotion != "neutral" for clip in folds.clips])
    target = np.asarray([clip.intensity for clip in folds.clips])
    error = np.abs(folds.predictions[NETWORK] - target)[felt].mean()
    assert judged.scores["actors_mae"] == pytest.approx(error, abs=1e-4)
    assert judged.scores["actors_r"] == pytest.approx(
        np.corrcoef(folds.predictions[NETWORK][felt], target[felt])[0, 1], abs=1e-4
    )
    assert not np.isfinite(folds.predictions["baseline"]).any()
