"""Batches of clips that are the same in every epoch: features are computed once, and a batch is one gather.

Where a recipe changes nothing of a clip while it trains (`Recipe.steady`; the paper's), computing angles anew in each
of a hundred epochs, and copying clips one by one into a batch, is time that matrix products don't get. Results are
those of `batches.training_batches`, to the bit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from fervor.emotions import emotion_index
from fervor_export.batches import Rows, arrange, cut, group, pad, plain_stream
from fervor_export.clip import Clip
from fervor_export.features import width
from fervor_export.network import Network
from fervor_export.recipe import Recipe

TOGETHER = 256
"""Clips whose features are computed at once."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedBatch:
    """Streams side by side, padded to the longest, as the network sees them."""

    features: Tensor  # [batch, time, feature]
    emotion: Tensor  # [batch, time] int64
    target: Tensor  # [batch, time]
    weight: Tensor  # [batch, time]
    lengths: Rows  # [batch] frames of each stream

    def groups(self) -> Iterator["PreparedBatch"]:
        """The batch by a few streams, each group padded to its own longest."""
        for part in group(self.lengths):
            yield PreparedBatch(
                part.of(self.features), part.of(self.emotion), part.of(self.target), part.of(self.weight), part.lengths
            )


class PreparedClips:
    """Clips as rows of one table: every frame's features, and the loss weights."""

    def __init__(self, clips: Sequence[Clip], recipe: Recipe, network: Network) -> None:
        self.recipe = recipe
        kept = [cut(clip, recipe) for clip in clips]
        self.lengths = np.asarray([clip.frames for clip in kept])  # [clip]
        self.starts = np.concatenate([[0], np.cumsum(self.lengths)[:-1]])  # [clip] row of a clip's first frame
        rows = int(self.lengths.sum()) + 1  # the last row stands for padding: all zero
        self.features = torch.zeros(rows, width(network.config.features))  # [row, feature]
        self.weight = torch.zeros(rows)  # [row]
        self.emotion = torch.tensor([emotion_index(clip.emotion) for clip in kept])  # [clip]
        self.target = torch.tensor([clip.intensity for clip in kept], dtype=torch.float32)  # [clip]
        by_length = np.argsort(self.lengths, kind="stable")
        for start in range(0, len(kept), TOGETHER):
            self._fill(kept, by_length[start : start + TOGETHER], network)

    def _fill(self, clips: Sequence[Clip], rows: Rows, network: Network) -> None:
        batch = pad([plain_stream(clips[row], self.recipe) for row in rows])
        with torch.no_grad():
            seen, _ = network.features(batch.rotations, batch.mask, network.zero_states(len(rows)))
        for place, row in enumerate(rows.tolist()):
            first, frames = int(self.starts[row]), int(self.lengths[row])
            self.features[first : first + frames] = seen[place, :frames]
            self.weight[first : first + frames] = batch.weight[place, :frames]

    def batches(self, *, seed: int, epoch: int) -> Iterator[PreparedBatch]:
        """One epoch: every clip once."""
        for rows in arrange(self.lengths.tolist(), self.recipe.batch_size, seed=seed, epoch=epoch):
            yield self._batch(rows)

    def _batch(self, rows: Rows) -> PreparedBatch:
        frames = np.arange(self.lengths[rows].max())
        inside = frames < self.lengths[rows, None]  # [batch, time]
        where = np.where(inside, self.starts[rows, None] + frames, len(self.weight) - 1)
        index = torch.from_numpy(where.ravel())
        shape, chosen = where.shape, torch.from_numpy(rows)
        seen = torch.from_numpy(inside)
        return PreparedBatch(
            self.features.index_select(0, index).view(*shape, -1),
            self.emotion[chosen, None] * seen,
            self.target[chosen, None] * seen,
            self.weight.index_select(0, index).view(shape),
            self.lengths[rows],
        )
