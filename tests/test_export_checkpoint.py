"""Checkpoints: what is saved comes back, and nothing else is loaded."""

import pickle
from dataclasses import replace

import pytest
import torch

from fervor.errors import ModelFileError
from fervor_export.checkpoint import TrainedNetwork, load_checkpoint, save_checkpoint
from fervor_export.export import describe
from networks import CONFIGS, frames, metadata, network


def trained(config) -> TrainedNetwork:
    return TrainedNetwork(
        network=network(config),
        recipe="default",
        seed=7,
        purpose="research",
        levels=metadata().levels,
        training=metadata().training,
        scores={"test_r": 0.5},
    )


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: f"{config.features} {config.head}")
def test_round_trip(config, tmp_path):
    original = trained(config)
    save_checkpoint(original, tmp_path / "deep" / "checkpoint.pt")
    copy = load_checkpoint(tmp_path / "deep" / "checkpoint.pt")
    assert replace(copy, network=original.network).scores == original.scores
    assert (copy.recipe, copy.seed, copy.purpose) == ("default", 7, "research")
    assert (copy.levels, copy.training) == (original.levels, original.training)
    assert copy.network.config == config
    data = tuple(map(torch.from_numpy, frames(2, 5)))
    with torch.no_grad():
        assert torch.equal(copy.network(*data).intensity, original.network(*data).intensity)


def test_a_description_is_of_the_network():
    described = describe(trained(CONFIGS[0]), name="mine", version="2", purpose="research")
    assert (described.name, described.version, described.purpose) == ("mine", "2", "research")
    assert (described.features, described.states) == (CONFIGS[0].features, CONFIGS[0].states)
    assert described.scores == {"test_r": 0.5}


def test_what_is_no_checkpoint(tmp_path):
    path = tmp_path / "checkpoint.pt"
    for content in (None, b"", b"not torch", pickle.dumps({"version": 1}, protocol=2)):
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ModelFileError, match=r"checkpoint\.pt is not a checkpoint of fervor: "):
            load_checkpoint(path)
    torch.save({"other": 1}, path)
    with pytest.raises(ModelFileError, match="is not a checkpoint of fervor: 'version'"):
        load_checkpoint(path)
    torch.save({"version": 99}, path)
    with pytest.raises(ModelFileError, match="is a checkpoint of version 99; expected 1"):
        load_checkpoint(path)
    torch.save({"version": 1, "config": {"features": "euler"}, "weights": {}}, path)
    with pytest.raises(ModelFileError, match="is not a checkpoint of fervor: "):
        load_checkpoint(path)


def test_loading_runs_no_code(tmp_path):
    class Evil:
        def __reduce__(self):
            return (pytest.fail, ("code ran",))

    torch.save({"version": Evil()}, tmp_path / "checkpoint.pt")
    with pytest.raises(ModelFileError):
        load_checkpoint(tmp_path / "checkpoint.pt")
