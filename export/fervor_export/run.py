"""A finished training run and the directory it leaves: config, metrics, curves, checkpoint, model file, model card."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fervor.metadata import ModelMetadata, TrainingData
from fervor_export.checkpoint import TrainedNetwork, save_checkpoint
from fervor_export.clip import digest
from fervor_export.curves import curves
from fervor_export.evaluation.held_out import write_learned_from
from fervor_export.export import describe, export_model, library_versions
from fervor_export.judgement import Judgement
from fervor_export.material import Material
from fervor_export.model_card import model_card
from fervor_export.recipe import Recipe
from fervor_export.training import TrainingResult

STATE = "training.pt"
"""File of the training under way in a run directory."""

FOLDS = "folds"
"""Folder of the folds' trainings in a run directory."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Everything there is to say about a training run."""

    command: str
    """What to type to train this network again."""
    material: Material
    recipe: Recipe
    seed: int
    threads: int
    result: TrainingResult
    judgement: Judgement

    def write(self, directory: Path) -> TrainedNetwork:
        """Write the directory; files of an earlier run in it are replaced.

        The checkpoint comes first: a model file that is refused costs no training.

        Raises:
            ModelFileError: the model file does not compute what the network does.
        """
        trained, history = self.trained(), self.result.history
        save_checkpoint(trained, directory / "checkpoint.pt")
        write_learned_from(self.material.seen, directory)
        _write_json(directory / "config.json", self._config())
        (directory / "curves.svg").write_text(curves(history, kept=self.result.kept.number), encoding="utf-8")
        metrics = {
            "scores": trained.scores,
            "kept_epoch": self.result.kept.number,
            "stopped": self.result.stopped,
            "levels": trained.levels.model_dump(),
            "history": [asdict(epoch) for epoch in history],
        }
        _write_json(directory / "metrics.json", metrics)
        metadata = describe(trained, name=f"fervor-{trained.purpose}", version="0.1.0", purpose=trained.purpose)
        report = export_model(trained.network, metadata, directory / "model.onnx")
        _write_json(directory / "metrics.json", metrics | {"parity": asdict(report)})
        (directory / "model_card.md").write_text(self._card(metadata), encoding="utf-8")
        return trained

    def _card(self, metadata: ModelMetadata) -> str:
        done, all_ = len(self.result.history), self.recipe.epochs
        ended = f"Time ended training after epoch {done} of {all_}." if self.result.stopped == "time" else ""
        return model_card(metadata, command=self.command, ended=ended)

    def trained(self) -> TrainedNetwork:
        """The network with all that its model file says of it."""
        material, seen = self.material, self.material.seen
        return TrainedNetwork(
            network=self.result.network,
            recipe=self.recipe.name,
            seed=self.seed,
            purpose=material.purpose,
            levels=self.judgement.levels,
            training=TrainingData(
                description=material.description,
                sha256=digest(seen),
                recordings=len({clip.name for clip in seen}),
                hours=round(sum(clip.seconds for clip in seen) / 3600, 2),
            ),
            scores=self.judgement.scores,
        )

    def _config(self) -> dict[str, Any]:
        return {
            "command": self.command,
            "recipe": asdict(self.recipe),
            "seed": self.seed,
            "threads": self.threads,
            "data": {
                "description": self.material.description,
                "clips": len(self.material.everything),
                "sha256": digest(self.material.everything),
                "learned_from": len(self.material.learn),
                "chose_the_epoch": len(self.material.validate),
                "tested": len(self.material.test),
            },
            "libraries": library_versions(),
        }


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
