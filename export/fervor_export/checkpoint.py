"""A trained network on disk, with what its model file will say of it; plain values only, so loading runs no code."""

import pickle
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import torch

from fervor.errors import ModelFileError
from fervor.metadata import LevelRule, TrainingData
from fervor_export.network import Network, NetworkConfig

VERSION = 1
"""Of the layout of the file."""


@dataclass(frozen=True, slots=True, eq=False)
class TrainedNetwork:
    """What a training run leaves."""

    network: Network
    recipe: str
    seed: int
    purpose: Literal["demo", "research"]
    levels: LevelRule
    training: TrainingData
    scores: dict[str, float]


def save_checkpoint(trained: TrainedNetwork, path: Path) -> None:
    """Write a trained network to `path`."""
    content = {
        "version": VERSION,
        "config": asdict(trained.network.config),
        "weights": trained.network.state_dict(),
        "recipe": trained.recipe,
        "seed": trained.seed,
        "purpose": trained.purpose,
        "levels": trained.levels.model_dump(),
        "training": trained.training.model_dump(),
        "scores": trained.scores,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.save(content, path)


def load_checkpoint(path: Path) -> TrainedNetwork:
    """Read what `save_checkpoint` wrote.

    Raises:
        ModelFileError: the file can't be read, or is not such a checkpoint.
    """
    try:
        content = torch.load(path, weights_only=True)
        if content["version"] != VERSION:
            raise ModelFileError(f"{path} is a checkpoint of version {content['version']}; expected {VERSION}")
        network = Network(NetworkConfig(**content["config"]))
        network.load_state_dict(content["weights"])
        return TrainedNetwork(
            network=network,
            recipe=content["recipe"],
            seed=content["seed"],
            purpose=content["purpose"],
            levels=LevelRule.model_validate(content["levels"]),
            training=TrainingData.model_validate(content["training"]),
            scores=content["scores"],
        )
    except (OSError, EOFError, KeyError, TypeError, ValueError, RuntimeError, pickle.UnpicklingError) as error:
        raise ModelFileError(f"{path} is not a checkpoint of fervor: {error}") from error
