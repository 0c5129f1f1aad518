"""What an evaluation says on a terminal: warnings first, the paper's table, and no number that is none."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from fervor_export.evaluation.estimator import NetworkEstimator, Reading
from fervor_export.evaluation.evaluate import Evaluated, Material, Options, evaluate_model
from fervor_export.evaluation.terminal import print_evaluation
from fervor_export.synthetic import synthesise_dataset
from networks import network

GRID = {"svr__C": (1.0,), "svr__gamma": ("scale",), "svr__epsilon": (0.05,)}


@pytest.fixture(scope="module")
def evaluated() -> Evaluated:
    clips = [replace(clip, actor=f"[b]{index % 3}") for index, clip in enumerate(synthesise_dataset(clips=22, seed=1))]
    options = Options(grid=GRID, invariance_clips=3, drift_minutes=1, drift_streams=1)
    material = Material(clips, "x", procedural=True, notes=["Rows left out: [red]7."])
    return evaluate_model(NetworkEstimator(network()), material, Reading(last=False), model="m", options=options)


def test_everything_fits_eighty_columns(evaluated):
    out = io.StringIO()
    print_evaluation(Console(file=out, width=80), evaluated.result)
    said = out.getvalue()
    assert said.startswith("Demo: this motion was generated")
    assert "Rows left out: [red]7." in said
    for what in (
        "LSTM", "SVM", "noise ceiling", "the paper, 5 folds", "emotion mean", "joint speed by emotion", "CCC",
        "mean absolute error", "spread ratio", "calibration error", "balanced accuracy", "network, wrong emotion",
        "r within after 1 s", "camera turned, rotations", "30 % of the frames lost", "one arm unseen", "staggered",
    ):  # fmt: skip
        assert what in said, what
    assert "…" not in said.partition("Pearson r")[2]
    assert "nan" not in said.replace("dominant", "")
    assert "-0.00 " not in said
