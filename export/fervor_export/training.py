"""Trains a network on clips: deterministic by seed on one machine, and able to go on where it was stopped.

Which epoch's weights are kept is the recipe's choice: those that do best on actors kept for it, or the last, and then
all clips are learned from. A training that has a file for its state writes it after every epoch; begun again with the
same clips, recipe and seed, it goes on there, and ends with the same bits as one that was never stopped.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from fervor.errors import DataError
from fervor_export.clip import Clip
from fervor_export.data.augment import augment
from fervor_export.network import Network
from fervor_export.recipe import Recipe
from fervor_export.trainer import Epoch, Stopped, Trainer
from fervor_export.training_state import TrainingState, identity

__all__ = ["Epoch", "TrainingResult", "copies", "sides", "split_by_actor", "train"]


@dataclass(frozen=True, slots=True, eq=False)
class TrainingResult:
    """The network with the weights that were kept, and how it came to them."""

    network: Network
    history: tuple[Epoch, ...]
    kept: Epoch
    """The epoch whose weights the network has."""
    stopped: Stopped
    """What ended training."""


def split_by_actor(clips: Sequence[Clip], *, share: float = 0.2, seed: int = 0) -> tuple[list[Clip], list[Clip]]:
    """Training and validation clips, no actor on both sides; about `share` of the actors validate.

    Raises:
        DataError: fewer than two actors.
    """
    actors = sorted({clip.actor for clip in clips})
    if len(actors) < 2:
        raise DataError(f"{len(clips)} clips of {len(actors)} actor(s) can't be split by actor; expected two or more")
    held = set(np.random.default_rng(seed).permutation(actors)[: max(1, round(share * len(actors)))].tolist())
    return [clip for clip in clips if clip.actor not in held], [clip for clip in clips if clip.actor in held]


def sides(clips: Sequence[Clip], recipe: Recipe, *, seed: int = 0) -> tuple[list[Clip], list[Clip]]:
    """Clips to learn from, and clips to choose the epoch by: none where the recipe keeps the last.

    Raises:
        DataError: fewer than two actors, where the recipe needs some to choose by.
    """
    return (list(clips), []) if recipe.keep == "last" else split_by_actor(clips, seed=seed)


def copies(clips: Sequence[Clip], recipe: Recipe) -> list[Clip]:
    """What a recipe learns from when it is given clips: with their mirror images and phases, if it asks for some."""
    if not recipe.mirror and recipe.phases == 1:
        return list(clips)
    return augment(clips, mirror=recipe.mirror, phases=recipe.phases)


def train(
    clips: Sequence[Clip],
    validation: Sequence[Clip],
    recipe: Recipe,
    *,
    seed: int = 0,
    max_minutes: float | None = None,
    state: Path | None = None,
    on_epoch: Callable[[Epoch], None] = lambda _: None,
    on_batch: Callable[[int], None] = lambda _: None,
) -> TrainingResult:
    """Train a network by a recipe.

    Args:
        clips: to learn from, `copies` included.
        validation: of other actors, to choose the epoch by; may be empty where the recipe keeps the last.
        recipe: how.
        seed: of weights, order and augmentation; with the same seed, clips and thread count a run repeats itself.
        max_minutes: ends training after the epoch that reaches it, minutes before an interruption included (then where
            it ends depends on the machine).
        state: file of the training under way; if it is there, training goes on from it.
        on_epoch: told of each epoch.
        on_batch: told how many clips each batch had.

    Raises:
        DataError: no clips where some are needed, or an actor on both sides.
        InputError: `state` is of another training.
    """
    _check_split(clips, validation, recipe)
    whose = identity(clips, validation, recipe, seed=seed)
    begun = None if state is None else TrainingState.load(state, whose)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        trainer = Trainer(clips, validation, recipe, seed)
        if begun is not None:
            trainer.resume(begun.content)
        stopped = trainer.over(max_minutes)
        while stopped is None:
            done = trainer.epoch(on_batch)
            if state is not None:
                TrainingState(whose, trainer.content()).save(state)
            on_epoch(done)
            stopped = trainer.over(max_minutes)
        return TrainingResult(trainer.finish(), tuple(trainer.history), trainer.kept, stopped)


def _check_split(clips: Sequence[Clip], validation: Sequence[Clip], recipe: Recipe) -> None:
    if not clips or (recipe.keep == "best" and not validation):
        raise DataError(f"training needs clips on both sides; there are {len(clips)} and {len(validation)}")
    both = sorted({clip.actor for clip in clips} & {clip.actor for clip in validation})
    if both:
        raise DataError(f"actors {', '.join(both)} are among the training and the validation clips")
