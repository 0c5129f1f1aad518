"""What a network says of clips, and how well it fits.

A clip's prediction is its last frame's intensity, or the mean over its frames after the first second, as the recipe's
loss has it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from fervor_export.batches import GROUP, Batch, pad, plain_stream
from fervor_export.clip import Clip
from fervor_export.data.label import NEUTRAL
from fervor_export.network import Network
from fervor_export.prepared import PreparedBatch
from fervor_export.recipe import Recipe
from fervor_export.scores import Scores, score

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Predictions:
    """Intensities that a network gives clips."""

    labelled: Floats  # [clip] under the clip's emotion
    unlabelled: Floats  # [clip] under no emotion


def predict(network: Network, clips: Sequence[Clip], recipe: Recipe, *, batch_size: int = GROUP) -> Predictions:
    """One number per clip, with and without its emotion label."""
    order = sorted(range(len(clips)), key=lambda index: clips[index].frames)
    predicted = np.zeros((2, len(clips)))
    was_training = network.training
    network.eval()
    with torch.no_grad():
        for start in range(0, len(order), batch_size):
            rows = order[start : start + batch_size]
            batch = pad([plain_stream(clips[row], recipe) for row in rows])
            total = batch.weight.sum(1)
            for which, intensity in enumerate(intensities(network, batch)):
                predicted[which, rows] = ((intensity * batch.weight).sum(1) / total).numpy()
    network.train(was_training)
    return Predictions(*predicted)


def intensities(network: Network, batch: Batch | PreparedBatch) -> tuple[Tensor, Tensor]:
    """Intensities [batch, time] under each frame's emotion, and under none."""
    reset = network.zero_states(len(batch.target))
    if isinstance(batch, PreparedBatch):
        seen = batch.features
    else:
        seen, _ = network.features(batch.rotations, batch.mask, reset)
    descriptor, _ = network.describe(seen, reset)
    logits = network.head(descriptor)  # [batch, time, 12]
    labelled = logits.gather(-1, batch.emotion.unsqueeze(-1)).squeeze(-1)
    return labelled.sigmoid(), logits[..., -1].sigmoid()


def fit(clips: Sequence[Clip], predictions: Predictions) -> Scores:
    """How the labelled predictions fit the clips' intensities; neutral, which has none, is left out if it can be."""
    emotions = np.asarray([clip.emotion for clip in clips])
    felt = emotions != NEUTRAL if (emotions != NEUTRAL).any() else np.full(len(clips), fill_value=True)
    target = np.asarray([clip.intensity for clip in clips])
    return score(predictions.labelled[felt], target[felt], emotions[felt].tolist())
