"""From what was asked of `fervor train` to a finished run: data, folds if asked for, training, judgement."""

from dataclasses import dataclass
from pathlib import Path

from fervor_export.data.dataset import SYNTHETIC, load_dataset
from fervor_export.data.progress import loading_bar
from fervor_export.evaluation import duplicates
from fervor_export.evaluation.estimator import Reading
from fervor_export.evaluation.evaluate import ACTORS
from fervor_export.evaluation.protocols import Budget, Learner
from fervor_export.evaluation.protocols import run as run_protocol
from fervor_export.evaluation.splits import by_actor
from fervor_export.judgement import held_out, out_of_fold
from fervor_export.material import Material, gather
from fervor_export.recipe import Recipe
from fervor_export.run import FOLDS, STATE, Run
from fervor_export.training import TrainingResult, copies, train
from fervor_export.watching import Watcher, watching


@dataclass(frozen=True, slots=True)
class Order:
    """What a person asked for."""

    data: str
    recipe: Recipe
    seed: int
    clips: int
    """To synthesise."""
    folds: int | None
    """Of actors; None: some actors are held out instead."""
    minutes: float | None
    """Of all training."""
    threads: int

    @property
    def command(self) -> str:
        """What to type to have the same again."""
        clips = f" --clips {self.clips}" if self.data == SYNTHETIC else ""
        folds = f" --folds {self.folds}" if self.folds else ""
        return (
            f"fervor train --data {self.data} --recipe {self.recipe.name} --seed {self.seed}{clips} "
            f"--epochs {self.recipe.epochs}{folds} --threads {self.threads}"
        )


def train_run(order: Order, directory: Path) -> Run:
    """Train as ordered; what lies half done in `directory` is gone on with.

    Raises:
        DataError: the data set can't be used, or has too few actors.
        InputError: the training in `directory` is another one.
    """
    return _by_folds(order, order.folds, directory) if order.folds else _held_out(order, directory)


def train_on(
    material: Material, recipe: Recipe, directory: Path, watcher: Watcher, *, seed: int, minutes: float | None
) -> TrainingResult:
    """The training of a run directory."""
    learn, state = copies(material.learn, recipe), directory / STATE
    return train(
        learn, material.validate, recipe, seed=seed, max_minutes=minutes, state=state, on_epoch=watcher.epoch
    )  # fmt: skip


def _held_out(order: Order, directory: Path) -> Run:
    """Learn from some actors, and be judged by the others."""
    recipe, seed = order.recipe, order.seed
    with loading_bar() as told:
        material = gather(order.data, recipe, clips=order.clips, seed=seed, progress=told)
    with watching(1, recipe.epochs) as watcher:
        result = train_on(material, recipe, directory, watcher, seed=seed, minutes=order.minutes)
    return Run(order.command, material, recipe, seed, order.threads, result, held_out(result, material, recipe))


def _by_folds(order: Order, folds: int, directory: Path) -> Run:
    """Be judged by folds of actors, and then learn from all."""
    recipe, seed = order.recipe, order.seed
    with loading_bar() as told:
        data = load_dataset(order.data, progress=told, clips=order.clips, seed=seed)
    split = by_actor(data.clips, most=folds, seed=seed, same=duplicates.groups(data.clips))
    budget = Budget(order.minutes, len(split) + 1)
    with watching(len(split) + 1, recipe.epochs) as watcher:
        judged = run_protocol(
            data.clips,
            split,
            Learner(recipe, seed, watcher.epoch, keep=directory / FOLDS).learn,
            Reading.of(recipe),
            handcrafted=None,
            budget=budget,
            seed=seed,
            tell=watcher.begin,
        )
        watcher.begin("all clips", len(split))
        material = Material.whole(data, recipe, seed=seed)
        result = train_on(material, recipe, directory, watcher, seed=seed, minutes=budget.next())
    return Run(order.command, material, recipe, seed, order.threads, result, out_of_fold({ACTORS: judged}))
