"""The program killed while it trains, and started again: the same bits as if nothing had happened."""

import json
import signal
from pathlib import Path

import pytest

from datasets import write_rated
from program import fervor, start_fervor

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


def killed_after(line: str, *arguments: object) -> None:
    """Run the program, and kill it when it says that."""
    process = start_fervor(*arguments)
    assert process.stderr is not None
    for said in process.stderr:
        if line in said:
            process.send_signal(signal.SIGKILL)
            break
    rest = process.communicate(timeout=300)
    assert process.returncode == -signal.SIGKILL, rest


def whole(*arguments: object) -> None:
    done = fervor(*arguments, timeout=900)
    assert done.returncode == 0, done.stderr


def without_times(path: Path) -> object:
    """JSON without what a clock said."""

    def plain(value: object) -> object:
        if isinstance(value, dict):
            return {key: plain(entry) for key, entry in value.items() if key != "seconds"}
        return [plain(entry) for entry in value] if isinstance(value, list) else value

    return plain(json.loads(path.read_text()))


@pytest.mark.parametrize("recipe", ["default", "paper"])
def test_training_outlives_a_kill(recipe, tmp_path):
    manifest = write_rated(tmp_path / "data")
    command = ["train", "--data", manifest, "--recipe", recipe, "--epochs", 5, "--seed", 3, "--out"]
    killed_after("epoch   1", *command, tmp_path / "killed")
    killed_after("epoch   3", *command, tmp_path / "killed")
    assert not (tmp_path / "killed" / "model.onnx").exists()
    whole(*command, tmp_path / "killed")
    whole(*command, tmp_path / "whole")
    same_run(tmp_path / "killed", tmp_path / "whole")
    refused = fervor(*command[:-2], 4, "--out", tmp_path / "killed")
    assert refused.returncode == 65
    assert "training.pt belongs to another training, so this one can't go on there: " in refused.stderr
    assert "seed 3 instead of 4" in refused.stderr
    assert refused.stderr.strip().count("\n") == 0


def test_the_experiment_outlives_kills(tmp_path):
    write_rated(tmp_path / "data")
    command = ["reproduce", tmp_path / "data", "--epochs", 3, "--folds", 2, "--out"]
    killed_after("fold 1 of 2, network, epoch   2", *command, tmp_path / "killed")
    killed_after("actors left out, 3 folds: fold 2 of 3, network, epoch   1", *command, tmp_path / "killed")
    killed_after("all clips, epoch   2", *command, tmp_path / "killed")
    whole(*command, tmp_path / "killed")
    whole(*command, tmp_path / "whole")
    same_run(tmp_path / "killed", tmp_path / "whole")
    here, there = tmp_path / "killed", tmp_path / "whole"
    assert (here / "predictions.csv").read_bytes() == (there / "predictions.csv").read_bytes()
    for name in ("evaluation.json", "data.json"):
        assert without_times(here / name) == without_times(there / name)


def same_run(here: Path, there: Path) -> None:
    for name in ("model.onnx", "model_card.md", "curves.svg", "config.json", "learned_from.json"):
        assert (here / name).read_bytes() == (there / name).read_bytes(), name
    assert without_times(here / "metrics.json") == without_times(there / "metrics.json")
