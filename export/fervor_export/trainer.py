"""The moving parts of a training: network, optimizer, schedule, and what has been learned of them so far."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import torch

from fervor_export.batches import Batch, batches_an_epoch, pad, plain_stream, training_batches
from fervor_export.clip import Clip
from fervor_export.network import Network, NetworkConfig
from fervor_export.objective import loss, make_optimizer
from fervor_export.prediction import fit, intensities, predict
from fervor_export.prepared import PreparedBatch, PreparedClips
from fervor_export.recipe import Recipe
from fervor_export.scores import Scores

Stopped = Literal["epochs", "patience", "time"]

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
    validation: Scores | None
    """On actors kept for it; None where there are none."""
    seconds: float
    """Since training began, interruptions left out."""


class Trainer:
    """A training between two epochs."""

    def __init__(self, clips: Sequence[Clip], validation: Sequence[Clip], recipe: Recipe, seed: int) -> None:
        self.clips, self.validation, self.recipe, self.seed = clips, validation, recipe, seed
        self.started = time.monotonic()
        self.history: list[Epoch] = []
        self.network = Network(NetworkConfig(features=recipe.features, head=recipe.head))
        if recipe.standardise:
            self._standardise()
        self.prepared = PreparedClips(clips, recipe, self.network) if recipe.steady else None
        self.kept_weights = deepcopy(self.network.state_dict())
        self.optimizer = make_optimizer(self.network, recipe)
        steps = recipe.epochs * batches_an_epoch(len(clips), recipe.batch_size)
        self.schedule = torch.optim.lr_scheduler.CosineAnnealingLR(self.optimizer, steps) if recipe.anneal else None

    def _standardise(self) -> None:
        """Mean and deviation of the features of some clips."""
        some = np.random.default_rng((self.seed, 0)).permutation(len(self.clips))[:STANDARD_CLIPS]
        batch = pad([plain_stream(self.clips[int(index)], self.recipe) for index in some])
        with torch.no_grad():
            features, _ = self.network.features(batch.rotations, batch.mask, self.network.zero_states(len(some)))
        seen = features[batch.mask.any(-1)]  # [frame, feature]
        self.network.standardise(seen.mean(0), seen.std(0).clamp_min(LEAST_DEVIATION))

    # --- epochs -----------------------------------------------------------------------------------------------------

    def epoch(self, on_batch: Callable[[int], None]) -> Epoch:
        """One pass over the clips, and its validation."""
        self.network.train()
        losses, errors, weights = [], 0.0, 0.0
        for batch in self._batches():
            value, error = self._step(batch)
            losses.append(value)
            errors += error
            weights += float(batch.weight.sum())
            on_batch(len(batch.target))
        done = Epoch(
            number=len(self.history) + 1,
            loss=float(np.mean(losses)),
            train_mae=errors / max(weights, 1e-12),
            validation=self._validate(),
            seconds=time.monotonic() - self.started,
        )
        self.history.append(done)
        if self.kept is done:
            self.kept_weights = deepcopy(self.network.state_dict())
        return done

    def _batches(self) -> Iterator[Batch | PreparedBatch]:
        epoch = len(self.history) + 1
        if self.prepared is not None:
            return self.prepared.batches(seed=self.seed, epoch=epoch)
        return training_batches(self.clips, self.recipe, seed=self.seed, epoch=epoch)

    def _step(self, batch: Batch | PreparedBatch) -> tuple[float, float]:
        """Loss and summed weighted error of one batch, before the weights move."""
        groups = [(*intensities(self.network, group), group.target, group.weight) for group in batch.groups()]
        labelled, unlabelled, target, weight = (
            torch.cat([part.flatten() for part in parts]) for parts in zip(*groups, strict=True)
        )
        share = self.recipe.unknown_share
        value = (1 - share) * loss(labelled, target, weight, self.recipe.ccc_weight)
        if share:
            value = value + share * loss(unlabelled, target, weight, self.recipe.ccc_weight)
        self.optimizer.zero_grad()
        value.backward()  # type: ignore[no-untyped-call]
        if self.recipe.clip_gradient is not None:
            torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.recipe.clip_gradient)
        self.optimizer.step()
        if self.schedule is not None:
            self.schedule.step()
        error = ((labelled.detach() - target).abs() * weight).sum()
        return float(value.detach()), float(error)

    def _validate(self) -> Scores | None:
        if not self.validation:
            return None
        return fit(self.validation, predict(self.network, self.validation, self.recipe))

    # --- the end ----------------------------------------------------------------------------------------------------

    @property
    def kept(self) -> Epoch:
        """The epoch whose weights count so far: the last, or of those with the smallest validation error the first."""
        if self.recipe.keep == "last":
            return self.history[-1]
        return min(self.history, key=lambda epoch: epoch.validation.mae if epoch.validation else np.inf)

    def over(self, max_minutes: float | None) -> Stopped | None:
        """Why there is no further epoch; None if there is one."""
        if not self.history:
            return None
        done, recipe = len(self.history), self.recipe
        if done >= recipe.epochs:
            return "epochs"
        if recipe.keep == "best" and recipe.patience is not None and done - self.kept.number >= recipe.patience:
            return "patience"
        if max_minutes is not None and self.history[-1].seconds >= 60 * max_minutes:
            return "time"
        return None

    def finish(self) -> Network:
        """The network with the weights that are kept, ready for export."""
        self.network.load_state_dict(self.kept_weights)
        self.network.eval()
        self.network.fold()
        return self.network

    # --- going on ---------------------------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        """Everything needed to go on, as plain values; the chance of an epoch follows from the seed and its number."""
        return {
            "weights": self.network.state_dict(),
            "kept_weights": self.kept_weights,
            "optimizer": self.optimizer.state_dict(),
            "schedule": None if self.schedule is None else self.schedule.state_dict(),
            "random": torch.get_rng_state(),
            "history": [asdict(epoch) for epoch in self.history],
        }

    def resume(self, content: Mapping[str, Any]) -> None:
        """Go on from what `content` gave."""
        self.network.load_state_dict(content["weights"])
        self.kept_weights = content["kept_weights"]
        self.optimizer.load_state_dict(content["optimizer"])
        if self.schedule is not None:
            self.schedule.load_state_dict(content["schedule"])
        torch.set_rng_state(content["random"])
        self.history = [
            Epoch(**(epoch | {"validation": None if epoch["validation"] is None else Scores(**epoch["validation"])}))
            for epoch in content["history"]
        ]
        self.started = time.monotonic() - self.history[-1].seconds
