"""A finished training run and the directory it leaves: config, metrics, checkpoint, model file, model card."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fervor.metadata import TrainingData
from fervor_export.checkpoint import TrainedNetwork, save_checkpoint
from fervor_export.clip import digest
from fervor_export.data.dataset import SYNTHETIC
from fervor_export.evaluation.held_out import write_learned_from
from fervor_export.export import describe, export_model, library_versions
from fervor_export.material import Material
from fervor_export.model_card import model_card
from fervor_export.prediction import fit, predict
from fervor_export.recipe import Recipe
from fervor_export.training import TrainingResult


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Everything there is to say about a training run."""

    data: str
    material: Material
    recipe: Recipe
    seed: int
    threads: int
    result: TrainingResult

    def write(self, directory: Path) -> TrainedNetwork:
        """Write the directory; files of an earlier run in it are replaced.

        The checkpoint comes first: a model file that is refused costs no training.

        Raises:
            ModelFileError: the model file does not compute what the network does.
        """
        trained = self.trained()
        save_checkpoint(trained, directory / "checkpoint.pt")
        write_learned_from(self.material.seen, directory)
        _write_json(directory / "config.json", self._config())
        metrics = {
            "scores": trained.scores,
            "best_epoch": self.result.best.number,
            "stopped": self.result.stopped,
            "levels": trained.levels.model_dump(),
            "history": [asdict(epoch) for epoch in self.result.history],
        }
        _write_json(directory / "metrics.json", metrics)
        metadata = describe(trained, name=f"fervor-{trained.purpose}", version="0.1.0", purpose=trained.purpose)
        report = export_model(trained.network, metadata, directory / "model.onnx")
        _write_json(directory / "metrics.json", metrics | {"parity": asdict(report)})
        (directory / "model_card.md").write_text(model_card(metadata, command=self.command()), encoding="utf-8")
        return trained

    def trained(self) -> TrainedNetwork:
        """The network, scored on the test clips."""
        network, material, seen = self.result.network, self.material, self.material.seen
        test = fit(material.test, predict(network, material.test, self.recipe))
        return TrainedNetwork(
            network=network,
            recipe=self.recipe.name,
            seed=self.seed,
            purpose=material.purpose,
            levels=self.result.levels,
            training=TrainingData(
                description=material.description,
                sha256=digest(seen),
                recordings=len({clip.name for clip in seen}),
                hours=round(sum(clip.seconds for clip in seen) / 3600, 2),
            ),
            scores=test.as_dict("test_") | self.result.best.validation.as_dict("validation_"),
        )

    def command(self) -> str:
        """What to type to train this network again."""
        clips = f" --clips {len(self.material.seen)}" if self.data == SYNTHETIC else ""
        return (
            f"fervor train --data {self.data} --recipe {self.recipe.name} --seed {self.seed}{clips} "
            f"--epochs {self.recipe.epochs} --threads {self.threads}"
        )

    def _config(self) -> dict[str, Any]:
        return {
            "command": self.command(),
            "data": self.data,
            "recipe": asdict(self.recipe),
            "seed": self.seed,
            "threads": self.threads,
            "clips": len(self.material.seen),
            "libraries": library_versions(),
        }


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
