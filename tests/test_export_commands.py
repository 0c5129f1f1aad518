"""`fervor train` and `fervor export`, from start to a file that the service takes."""

import json

import pytest
import torch
import typer
from typer.testing import CliRunner

from datasets import motion, write_npz, write_rated
from fervor.errors import DataError, InputError, ModelFileError
from fervor.model import Model, check_row_independence
from fervor_export import commands
from fervor_export.checkpoint import load_checkpoint
from fervor_export.clip import digest
from fervor_export.synthetic import synthesise_dataset
from networks import DEFAULT


def app() -> typer.Typer:
    made = typer.Typer(pretty_exceptions_enable=False)
    made.command()(commands.train)
    made.command()(commands.export)
    return made


def invoke(*arguments: str):
    threads = torch.get_num_threads()
    result = CliRunner().invoke(app(), arguments, catch_exceptions=False)
    assert torch.get_num_threads() == threads or arguments[0] == "train"
    return result


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = tmp_path_factory.mktemp("runs") / "first"
    options = {"--data": "synthetic", "--clips": "120", "--epochs": "1", "--threads": "1", "--seed": "4"}
    result = invoke("train", *(word for option in options.items() for word in option), "--out", str(directory))
    assert result.exit_code == 0
    return directory, result.output


def test_what_a_run_leaves(run):
    directory, output = run
    assert {path.name for path in directory.iterdir()} == {
        "config.json", "metrics.json", "curves.svg", "checkpoint.pt", "training.pt", "model.onnx", "model_card.md",
        "learned_from.json",
    }  # fmt: skip
    assert "epoch   1" in output
    assert f"{directory}: epoch 1 of 1; on held-out clips MAE 0." in output.replace("\n", "")
    config = json.loads((directory / "config.json").read_text())
    assert (config["recipe"]["name"], config["seed"], config["data"]["clips"]) == ("default", 4, 120)
    assert config["data"]["learned_from"] + config["data"]["chose_the_epoch"] == 120
    assert config["data"]["sha256"] == digest(synthesise_dataset(clips=120, seed=4000))
    assert config["libraries"]["torch"] == torch.__version__
    assert config["command"] == (
        "fervor train --data synthetic --recipe default --seed 4 --clips 120 --epochs 1 --threads 1"
    )
    metrics = json.loads((directory / "metrics.json").read_text())
    assert len(metrics["history"]) == 1
    assert metrics["parity"]["largest"] < 1e-5
    assert metrics["scores"]["test_mae"] < 0.5


def test_the_model_file_is_a_demo_that_the_service_takes(run):
    model = Model.load(run[0] / "model.onnx")
    assert (model.metadata.name, model.metadata.purpose) == ("fervor-demo", "demo")
    assert model.metadata.states == DEFAULT.states
    assert model.metadata.training.recordings == 120
    assert 0 < model.metadata.training.hours < 1
    assert check_row_independence(model, rows=9, largest=16) == 1


def test_the_card_says_what_it_is(run):
    card = (run[0] / "model_card.md").read_text()
    for told in (
        "demo",
        "not science",
        "share of\nobservers expected to recognise",
        "fervor train --data synthetic",
        "| surprise |",
    ):
        assert told in card


def test_export_of_a_checkpoint(run, tmp_path):
    out = tmp_path / "mine.onnx"
    result = invoke("export", str(run[0] / "checkpoint.pt"), "--out", str(out), "--name", "mine", "--version", "3")
    assert result.exit_code == 0
    assert "mine 3, largest difference to the network" in result.output
    mine, first = Model.load(out), Model.load(run[0] / "model.onnx")
    assert (mine.metadata.name, mine.metadata.version, mine.metadata.purpose) == ("mine", "3", "demo")
    assert mine.metadata.training == first.metadata.training


def test_export_to_a_repository_of_triton(run, tmp_path):
    out, repository = tmp_path / "mine.onnx", tmp_path / "repository"
    options = ("--out", str(out), "--name", "mine", "--triton", str(repository))
    result = invoke("export", str(run[0] / "checkpoint.pt"), *options)
    assert f"{repository / 'mine' / '1'}: a version for Triton" in result.output
    assert (repository / "mine" / "1" / "model.onnx").read_bytes() == out.read_bytes()
    result = invoke("export", str(out), "--triton", str(repository))
    assert result.output == f"{repository / 'mine' / '1'}: a version for Triton\n"


def test_a_refused_model_file_costs_no_training(tmp_path, monkeypatch):
    def refuse(*_):
        raise ModelFileError("refused")

    monkeypatch.setattr("fervor_export.run.export_model", refuse)
    with pytest.raises(ModelFileError, match="refused"):
        invoke("train", "--clips", "60", "--epochs", "1", "--threads", "1", "--out", str(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {
        "checkpoint.pt",
        "config.json",
        "curves.svg",
        "metrics.json",
        "learned_from.json",
        "training.pt",
    }
    assert load_checkpoint(tmp_path / "checkpoint.pt").purpose == "demo"


def test_errors_are_ours_to_tell(tmp_path):
    with pytest.raises(ModelFileError, match="is not a checkpoint of fervor"):
        invoke("export", str(tmp_path / "absent.pt"))


def test_unknown_choices_are_refused():
    for arguments in (("train", "--recipe", "mine"), ("train", "--clips", "1")):
        assert invoke(*arguments).exit_code == 2


@pytest.mark.parametrize("recipe", ["default", "paper"])
def test_a_data_set_of_ones_own(tmp_path, recipe):
    rows = ["file,emotion,intensity,actor"]
    for number in range(12):
        share = number / 12
        write_npz(tmp_path / f"take{number}.npz", motion("joy", share=share, seed=number, rate_hz=60.0))
        rows.append(f"take{number}.npz,joy,{share:.2f},actor {number % 4}")
    (tmp_path / "manifest.csv").write_text("\n".join(rows) + "\n")
    out = tmp_path / "run"
    done = invoke(
        "train", "--data", str(tmp_path / "manifest.csv"), "--recipe", recipe, "--epochs", "1", "--out", str(out)
    )
    assert done.exit_code == 0, done.output
    model = Model.load(out / "model.onnx")
    assert (model.metadata.name, model.metadata.purpose) == ("fervor-research", "research")
    assert 3 <= model.metadata.training.recordings < 12  # the test actors are not among them
    learned = json.loads((out / "learned_from.json").read_text())
    assert len(learned["actors"]) == 3
    held = model.metadata.levels.source
    assert held == ("6 clips of 2 held-out actors" if recipe == "default" else "3 clips of 1 held-out actor")
    assert ("validation_r" in model.metadata.scores) == (recipe == "default")


def test_folds_judge_a_recipe_and_everybody_is_learned_from(tmp_path):
    write_rated(tmp_path, count=24, actors=4)
    out = tmp_path / "run"
    options = ("train", "--data", str(tmp_path), "--epochs", "1", "--folds", "2", "--out", str(out))
    done = invoke(*options)
    assert done.exit_code == 0, done.output
    assert "all clips, epoch   1" in done.output
    assert "out of fold MAE 0." in done.output.replace("\n", "")
    model = Model.load(out / "model.onnx")
    assert model.metadata.levels.source == "out-of-fold predictions of 24 clips, 2 folds by actor"
    assert {"actors_r", "actors_r_within", "actors_mae"} <= model.metadata.scores.keys()
    assert len(json.loads((out / "learned_from.json").read_text())["recordings"]) == 24
    card = (out / "model_card.md").read_text()
    assert "| out of fold, actors left out |" in card
    assert "nobody is left to judge it" in card
    before = (out / "model.onnx").read_bytes()
    again = invoke(*options)
    assert "epoch   1  " not in again.output  # all is there
    assert (out / "model.onnx").read_bytes() == before


def test_another_seed_is_refused_unless_begun_anew(tmp_path):
    write_rated(tmp_path, count=24, actors=4)
    options = ["train", "--data", str(tmp_path), "--epochs", "1", "--out", str(tmp_path / "run")]
    invoke(*options)
    with pytest.raises(InputError, match=r"belongs to another training, .*seed 0 instead of 1"):
        invoke(*options, "--seed", "1")
    assert invoke(*options, "--seed", "1", "--restart").exit_code == 0
    assert json.loads((tmp_path / "run" / "config.json").read_text())["seed"] == 1


def test_time_that_ended_training_is_on_the_card(tmp_path):
    out = tmp_path / "run"
    invoke("train", "--clips", "40", "--epochs", "3", "--minutes", "0", "--out", str(out))
    assert "Time ended training after epoch 1 of 3." in (out / "model_card.md").read_text()
    assert json.loads((out / "metrics.json").read_text())["stopped"] == "time"


def test_a_data_set_that_is_not_there_is_one_sentence():
    with pytest.raises(DataError, match="ebmdb9"):
        invoke("train", "--data", "ebmdb9")
