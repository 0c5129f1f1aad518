"""Trains a network on clips: deterministic by seed on one machine, validated on other actors, the best weights kept."""

import time
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from fervor.errors import DataError
from fervor.metadata import LevelRule
from fervor_export.batches import Batch, pad, plain_stream, training_batches
from fervor_export.clip import Clip
from fervor_export.network import Network, NetworkConfig
from fervor_export.prediction import fit, intensities, level_rule, predict
from fervor_export.recipe import Recipe
from fervor_export.scores import Scores

STANDARD_CLIPS = 512
"""How many clips the mean and deviation of features are taken from."""

LEAST_DEVIATION = 0.2
"""Taken where a feature's is smaller: what hardly moves in training must not be blown up when it does, nor rounding:
with 0.05 the folded weights reached 22, and cell states of torch and onnxruntime differed by 2e-5."""


@dataclass(frozen=True, slots=True)
class Epoch:
    """One pass over the training clips."""

    number: int
    loss: float
    """Mean training loss, augmentation included."""
    train_mae: float
    """Weighted mean absolute error during the epoch, augmentation included."""
    validation: Scores
    seconds: float
    """Since training began."""


@dataclass(frozen=True, slots=True, eq=False)
class TrainingResult:
    """The network with its best weights, and how it came to them."""

    network: Network
    history: tuple[Epoch, ...]
    best: Epoch
    """The epoch with the smallest validation error."""
    levels: LevelRule
    stopped: Literal["epochs", "patience", "time"]
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


def train(
    clips: Sequence[Clip],
    validation: Sequence[Clip],
    recipe: Recipe,
    *,
    seed: int = 0,
    max_minutes: float | None = None,
    on_epoch: Callable[[Epoch], None] = lambda _: None,
    on_batch: Callable[[int], None] = lambda _: None,
) -> TrainingResult:
    """Train a network by a recipe.

    Args:
        clips: to learn from.
        validation: of other actors, to choose the best epoch and the thresholds by.
        recipe: how.
        seed: of weights, order and augmentation; with the same seed, clips and thread count a run repeats itself.
        max_minutes: ends training after the epoch that reaches it (then where it ends depends on the machine).
        on_epoch: told of each epoch.
        on_batch: told how many clips each batch had.

    Raises:
        DataError: no clips on one side, or an actor on both.
    """
    _check_split(clips, validation)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        trainer = _Trainer(clips, validation, recipe, np.random.default_rng(seed))
        for _ in range(recipe.epochs):
            on_epoch(trainer.epoch(on_batch))
            if trainer.stale:
                return trainer.finish("patience")
            if max_minutes is not None and trainer.history[-1].seconds >= 60 * max_minutes:
                return trainer.finish("time")
        return trainer.finish("epochs")


class _Trainer:
    """The moving parts of a training run."""

    def __init__(
        self, clips: Sequence[Clip], validation: Sequence[Clip], recipe: Recipe, random: np.random.Generator
    ) -> None:
        self.clips, self.validation, self.recipe, self.random = clips, validation, recipe, random
        self.started = time.monotonic()
        self.history: list[Epoch] = []
        self.network = Network(NetworkConfig(features=recipe.features, head=recipe.head))
        if recipe.standardise:
            self._standardise()
        self.best_weights = deepcopy(self.network.state_dict())
        self.optimizer = _optimizer(self.network, recipe)
        steps = recipe.epochs * -(-len(clips) // recipe.batch_size)
        self.schedule = torch.optim.lr_scheduler.CosineAnnealingLR(self.optimizer, steps) if recipe.anneal else None

    def _standardise(self) -> None:
        """Mean and deviation of the features of some clips."""
        some = self.random.permutation(len(self.clips))[:STANDARD_CLIPS]
        batch = pad([plain_stream(self.clips[int(index)], self.recipe) for index in some])
        with torch.no_grad():
            features, _ = self.network.features(batch.rotations, batch.mask, self.network.zero_states(len(some)))
        seen = features[batch.mask.any(-1)]  # [frame, feature]
        self.network.standardise(seen.mean(0), seen.std(0).clamp_min(LEAST_DEVIATION))

    def epoch(self, on_batch: Callable[[int], None]) -> Epoch:
        """One pass over the clips, and its validation."""
        self.network.train()
        losses, errors, weights = [], 0.0, 0.0
        for batch in training_batches(self.clips, self.recipe, self.random):
            value, error = self._step(batch)
            losses.append(value)
            errors += error
            weights += float(batch.weight.sum())
            on_batch(len(batch.target))
        scores = fit(self.validation, predict(self.network, self.validation, self.recipe))
        done = Epoch(
            number=len(self.history) + 1,
            loss=float(np.mean(losses)),
            train_mae=errors / max(weights, 1e-12),
            validation=scores,
            seconds=time.monotonic() - self.started,
        )
        if not self.history or scores.mae < self.best.validation.mae:
            self.best_weights = deepcopy(self.network.state_dict())
        self.history.append(done)
        return done

    def _step(self, batch: Batch) -> tuple[float, float]:
        """Loss and summed weighted error of one batch, before the weights move."""
        labelled, unlabelled = intensities(self.network, batch)
        share = self.recipe.unknown_share
        value = (1 - share) * loss(labelled, batch, self.recipe.ccc_weight)
        if share:
            value = value + share * loss(unlabelled, batch, self.recipe.ccc_weight)
        self.optimizer.zero_grad()
        value.backward()  # type: ignore[no-untyped-call]
        if self.recipe.clip_gradient is not None:
            torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.recipe.clip_gradient)
        self.optimizer.step()
        if self.schedule is not None:
            self.schedule.step()
        error = ((labelled.detach() - batch.target).abs() * batch.weight).sum()
        return float(value.detach()), float(error)

    @property
    def best(self) -> Epoch:
        """The epoch with the smallest validation error so far; of equal ones the first."""
        return min(self.history, key=lambda epoch: epoch.validation.mae)

    @property
    def stale(self) -> bool:
        """Whether the best epoch lies longer back than the recipe has patience."""
        return self.recipe.patience is not None and len(self.history) - self.best.number >= self.recipe.patience

    def finish(self, stopped: Literal["epochs", "patience", "time"]) -> TrainingResult:
        """The best weights, ready for export."""
        self.network.load_state_dict(self.best_weights)
        self.network.eval()
        self.network.fold()
        levels = level_rule(self.validation, predict(self.network, self.validation, self.recipe))
        return TrainingResult(self.network, tuple(self.history), self.best, levels, stopped)


def _optimizer(network: Network, recipe: Recipe) -> torch.optim.Optimizer:
    parameters = [parameter for parameter in network.parameters() if parameter.requires_grad]
    if recipe.optimizer == "adamw":
        return torch.optim.AdamW(parameters, recipe.learning_rate, weight_decay=recipe.weight_decay)
    # Keras' constants, as the paper names none: torch smooths ten times longer and damps less.
    return torch.optim.RMSprop(parameters, recipe.learning_rate, alpha=0.9, eps=1e-7, weight_decay=recipe.weight_decay)


def loss(predicted: Tensor, batch: Batch, ccc_weight: float) -> Tensor:
    """Mean absolute error and 1 - CCC of predictions [batch, time], each frame by its weight."""
    share = batch.weight / batch.weight.sum().clamp_min(1e-12)
    error = ((predicted - batch.target).abs() * share).sum()
    if not ccc_weight:
        return error
    mean_p, mean_t = (predicted * share).sum(), (batch.target * share).sum()
    off_p, off_t = predicted - mean_p, batch.target - mean_t
    scale = (off_p.square() * share).sum() + (off_t.square() * share).sum() + (mean_p - mean_t).square()
    ccc = 2 * (off_p * off_t * share).sum() / scale.clamp_min(1e-6)
    return (1 - ccc_weight) * error + ccc_weight * (1 - ccc)


def _check_split(clips: Sequence[Clip], validation: Sequence[Clip]) -> None:
    if not clips or not validation:
        raise DataError(f"training needs clips on both sides; there are {len(clips)} and {len(validation)}")
    both = sorted({clip.actor for clip in clips} & {clip.actor for clip in validation})
    if both:
        raise DataError(f"actors {', '.join(both)} are among the training and the validation clips")
