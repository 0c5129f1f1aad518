"""The paper's experiment, small: everything in one directory, and all of it from the same folds."""

import json
from dataclasses import replace

import pytest

from datasets import takes, write_ebmdb
from fervor.model import Model
from fervor_export.data.loading import quietly
from fervor_export.evaluation.evaluate import Options
from fervor_export.recipe import PAPER
from fervor_export.reproduce import Experiment, write_data_report
from fervor_export.watching import watching

GRID = {"svr__C": (1.0,), "svr__gamma": ("scale",), "svr__epsilon": (0.05,)}
QUICK = Options(folds=2, grid=GRID, invariance_clips=4, drift_minutes=1, drift_streams=1)
RECIPE = replace(PAPER, epochs=2)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("experiment")
    write_ebmdb(folder / "ebmdb", takes(22, actors=("AnBh", "DiMi", "HeGa")))
    experiment = Experiment(str(folder / "ebmdb"), RECIPE, 0, 2, 0, None, 1)
    return experiment, folder / "out", once(experiment, folder / "out")


def once(experiment: Experiment, directory):
    data, summary = experiment.load(quietly)
    write_data_report(data, summary, directory)
    with watching(experiment.trainings(data), experiment.recipe.epochs) as watcher:
        judged = experiment.judge(data, directory, watcher, QUICK)
        run = experiment.learn(data, judged, directory, watcher)
        assert watcher.pace.done == watcher.pace.total == 12
    return data, judged, run


def test_everything_lies_in_one_directory(done):
    _, directory, _ = done
    assert {path.name for path in directory.iterdir()} == {
        "data.html", "data.json", "evaluation.html", "evaluation.json", "predictions.csv", "folds", "training.pt",
        "config.json", "metrics.json", "curves.svg", "checkpoint.pt", "model.onnx", "model_card.md",
        "learned_from.json",
    }  # fmt: skip
    content = json.loads((directory / "data.json").read_text())
    assert content["clips"] == 22


def test_folds_judge_and_the_last_network_learns_from_everything(done):
    experiment, directory, (data, judged, run) = done
    model = Model.load(directory / "model.onnx")
    assert (model.metadata.features, model.metadata.purpose) == ("euler", "research")
    assert model.metadata.training.recordings == 22
    assert model.metadata.levels.source == "out-of-fold predictions of 22 clips, 3 folds by actor"
    assert model.metadata.levels.threshold == judged.result.thresholds.rule.threshold
    for name in ("recordings", "actors"):
        found = judged.result.protocol(name).predictor("network").scores
        assert model.metadata.scores[f"{name}_mae"] == found.mae.value
        assert model.metadata.scores[f"{name}_r_all"] == found.r_all.value
    assert run.result.kept.number == 2
    folds = judged.result.protocol("recordings").trainings
    assert [fold.train_clips for fold in folds] == [11, 11]
    assert {fold.best_epoch for fold in folds} == {2}  # the paper keeps the last
    assert experiment.trainings(data) == 6


def test_the_card_names_the_folds_and_the_command(done):
    _, directory, _ = done
    card = (directory / "model_card.md").read_text()
    assert "| out of fold, by recording | out of fold, actors left out |" in card
    assert "fervor reproduce" in card
    assert "--recipe paper --seed 0 --folds 2 --epochs 2 --threads 1" in card


def test_done_again_nothing_is_trained_again_and_all_is_the_same(done, monkeypatch):
    experiment, directory, _ = done
    names = ("model.onnx", "predictions.csv", "evaluation.json", "metrics.json", "model_card.md", "data.html")
    before = {name: (directory / name).read_bytes() for name in names}
    monkeypatch.setattr("fervor_export.trainer.Trainer.epoch", lambda *_: pytest.fail("trained again"))
    monkeypatch.setattr("fervor_export.evaluation.baseline.fit", lambda *_, **__: pytest.fail("fitted again"))
    data, summary = experiment.load(quietly)
    with watching(experiment.trainings(data), 2) as watcher:
        judged = experiment.judge(data, directory, watcher, QUICK)
        experiment.learn(data, judged, directory, watcher)
    assert {name: (directory / name).read_bytes() for name in names} == before
    assert summary.clips == 22


def test_time_that_is_short_is_told(done, tmp_path):
    experiment, *_ = done
    hurried = replace(experiment, minutes=0.0, recipe=replace(RECIPE, epochs=3))
    data, _ = hurried.load(quietly)
    with watching(hurried.trainings(data), 3) as watcher:
        judged = hurried.judge(data, tmp_path, watcher, replace(QUICK, minutes=0.0))
        hurried.learn(data, judged, tmp_path, watcher)
    assert any("time ended 2 of 2 trainings early" in warning for warning in judged.result.warnings)
    assert "time ended 3 of 3 trainings early" in (tmp_path / "evaluation.html").read_text()
    assert "Time ended training after epoch 1 of 3." in (tmp_path / "model_card.md").read_text()
