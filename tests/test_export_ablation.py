"""Ablation: every choice of the default recipe has a row, and rows are what they say."""

from dataclasses import fields, replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from datasets import write_rated
from fervor_export import ablate_command, ablation
from fervor_export.ablation import BASE, MEASURES, VARIANTS, ablate, measures
from fervor_export.ablation_page import page
from fervor_export.material import Material
from fervor_export.recipe import DEFAULT, PAPER, Recipe
from fervor_export.training import split_by_actor
from networks import network, waving_clips

HOW_LONG = {"name", "epochs", "patience", "phases"}
"""Fields of a recipe that are no choice between ways to learn, or that this data has nothing for."""

RECIPE = replace(DEFAULT, epochs=1, batch_size=16, patience=None)


def material() -> Material:
    clips = [replace(clip, emotion=("joy", "anger")[index % 2]) for index, clip in enumerate(waving_clips(60))]
    rest, test = split_by_actor(clips, seed=1)
    return Material("waves", "demo", clips, *split_by_actor(rest, seed=1), test)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(ablation, "DRIFT_MINUTES", 1)


def test_every_choice_has_its_row():
    changed = {name for variant in VARIANTS for name in variant.changes}
    assert changed == {field.name for field in fields(Recipe)} - HOW_LONG
    for variant in VARIANTS:
        assert variant.recipe(DEFAULT) != DEFAULT, variant.name
    differing = {field.name for field in fields(Recipe) if getattr(DEFAULT, field.name) != getattr(PAPER, field.name)}
    assert differing - HOW_LONG <= changed


def test_measures_are_of_what_they_say():
    clips = [replace(clip, emotion="joy") for clip in waving_clips(12)]
    found = measures(network(), clips)
    assert found.keys() == {measure.name for measure in MEASURES}
    blind = [replace(clip, mask=clip.mask & (np.arange(13) > 5)) for clip in clips]  # without trunk and left arm
    assert measures(network(), blind)["one_arm"] == pytest.approx(measures(network(), blind)["r_within"])
    assert found["one_arm"] != found["r_within"]


def test_it_goes_on_where_it_was_stopped(tmp_path):
    chosen = [variant for variant in VARIANTS if variant.name in ("no crops", "mirror images too")]
    told = []

    def stop(what, done):
        told.append((what, done))
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ablate(material(), RECIPE, variants=chosen, seeds=1, folder=tmp_path, tell=stop)
    assert told == [("default, seed 0", 0), ("no crops, seed 0", 1), ("mirror images too, seed 0", 2)]
    epochs = []
    resumed = ablate(material(), RECIPE, variants=chosen, seeds=1, folder=tmp_path, on_epoch=epochs.append)
    assert len(epochs) == 1
    assert resumed == ablate(material(), RECIPE, variants=chosen, seeds=1)
    assert list(resumed) == [BASE.name, "no crops", "mirror images too"]


def test_a_page_says_what_speaks_for_and_against():
    plain = dict.fromkeys([measure.name for measure in MEASURES], 0.5)
    results = {
        "default": [plain, plain],
        "no crops": [plain | {"r_within": 0.4, "mae": 0.4}, plain | {"r_within": 0.45, "mae": 0.3}],
        "additive head": [plain | {"r_within": 0.4}, plain | {"r_within": 0.6}],
    }
    known = {variant.name: variant for variant in VARIANTS}
    text = page(results, material(), RECIPE, known, command="fervor ablate --seeds 2")
    rows = {line.split("|")[1].strip(): line for line in text.splitlines() if line.startswith("| ")}
    assert rows["no crops (`crop 0.0 for 0.3`)"].endswith("| r within emotion | MAE |")
    assert rows["additive head (`head additive for gated`)"].endswith("|  |  |")
    assert "| 0.425 ± 0.035 |" in rows["no crops (`crop 0.0 for 0.3`)"]
    assert "fervor ablate --seeds 2" in text


def test_the_command(tmp_path):
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(ablate_command.ablate)
    write_rated(tmp_path / "data", count=24, actors=4)
    where = ["--out", str(tmp_path / "out"), "--page", str(tmp_path / "page.md")]
    options = ["--data", str(tmp_path / "data"), "--epochs", "1", "--seeds", "1", "--only", "no crops", *where]
    done = CliRunner().invoke(app, options, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "page.md").read_text() == (tmp_path / "out" / "ablation.md").read_text()
    assert "| no crops (`crop 0.0 for 0.3`) |" in done.stdout
    assert CliRunner().invoke(app, ["--only", "no such thing"]).exit_code == 2
