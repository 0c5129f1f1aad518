"""Estimates of whatever can estimate: a network just trained, a checkpoint, or a model file.

One pass gives every frame's intensity under each emotion and under none, because the emotion enters after the
recurrence. What is asked later (its own label, a wrong one, none, the first two seconds) is picked from that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
import torch

from fervor.emotions import EMOTIONS, emotion_index
from fervor.model import Model
from fervor.skeletons.rig import JOINTS
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.network import Network
from fervor_export.recipe import Recipe

Floats = npt.NDArray[np.float64]
Estimates = npt.NDArray[np.float32]
"""[frame, 12]: the emotions in order, then unknown."""

UNLABELLED = len(EMOTIONS)
"""The column of no label."""

FRAMES_TOGETHER = 30_000
"""Of all rows of a batch; bounds memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Poses without a label, from a reset on."""

    rotations: npt.NDArray[np.float32]  # [frame, 13, 4]
    mask: npt.NDArray[np.bool_]  # [frame, 13]

    def __len__(self) -> int:
        return len(self.rotations)

    @classmethod
    def of(cls, clip: Clip) -> "Motion":
        """A clip's motion."""
        return cls(clip.rotations, clip.mask)


class Estimator(Protocol):
    """Anything that turns motion into intensities."""

    def estimate(self, motions: Sequence[Motion]) -> list[Estimates]:
        """Estimates [frame, 12] of each motion, from a reset on."""
        ...


@dataclass(frozen=True, slots=True)
class NetworkEstimator:
    """A torch network."""

    network: Network

    def estimate(self, motions: Sequence[Motion]) -> list[Estimates]:
        """Estimates [frame, 12] of each motion, from a reset on."""
        self.network.eval()
        done: list[Estimates] = [np.empty((0, UNLABELLED + 1), np.float32)] * len(motions)
        with torch.inference_mode():
            for rows in _batches(motions):
                rotations, mask = _padded([motions[row] for row in rows])
                logits, _ = self.network.logits(torch.from_numpy(rotations), torch.from_numpy(mask))
                values = logits.sigmoid().numpy()
                for row, estimates in zip(rows, values, strict=True):
                    done[row] = estimates[: len(motions[row])].copy()
        return done


@dataclass(frozen=True, slots=True)
class ModelEstimator:
    """A model file, run as the service runs it."""

    model: Model

    def estimate(self, motions: Sequence[Motion]) -> list[Estimates]:
        """Estimates [frame, 12] of each motion, from a reset on."""
        done: list[Estimates] = [np.empty((0, UNLABELLED + 1), np.float32)] * len(motions)
        for rows in _batches(motions):
            rotations, mask = _padded([motions[row] for row in rows])
            unknown = np.zeros((*mask.shape[:2], len(EMOTIONS)), np.float32)
            outputs = self.model.run(rotations, mask, unknown, self.model.zero_states(len(rows)))
            values = np.concatenate([outputs.intensity_by_emotion, outputs.intensity[..., None]], -1)
            for row, estimates in zip(rows, values, strict=True):
                done[row] = estimates[: len(motions[row])]
        return done


@dataclass(frozen=True, slots=True)
class Reading:
    """How the estimates of a clip's frames become one number, as in `prediction`."""

    last: bool
    """The last frame's; else the mean over the frames after the warm-up."""
    settle_s: float = 1.0

    @classmethod
    def of(cls, recipe: Recipe) -> "Reading":
        """That of a recipe's loss."""
        return cls(recipe.loss_at == "last", recipe.settle_s)

    def value(self, estimates: npt.NDArray[np.floating]) -> float:
        """One number from the estimates of frames [frame] under one label."""
        first = len(estimates) - 1 if self.last else min(round(self.settle_s * RATE_HZ), len(estimates) - 1)
        return float(estimates[first:].mean(dtype=np.float64))

    def labelled(self, clips: Sequence[Clip], estimates: Sequence[Estimates]) -> Floats:
        """A number per clip [clip] under its own emotion."""
        pairs = zip(clips, estimates, strict=True)
        return np.asarray([self.value(values[:, emotion_index(clip.emotion)]) for clip, values in pairs])

    def under(self, labels: Sequence[int] | npt.NDArray[np.intp], estimates: Sequence[Estimates]) -> Floats:
        """A number per clip [clip] under given columns [clip]."""
        pairs = zip(labels, estimates, strict=True)
        return np.asarray([self.value(values[:, label]) for label, values in pairs])

    def unlabelled(self, estimates: Sequence[Estimates]) -> Floats:
        """A number per clip [clip] under no label."""
        return self.under([UNLABELLED] * len(estimates), estimates)


def _batches(motions: Sequence[Motion]) -> list[list[int]]:
    """Rows of similar length together."""
    batches: list[list[int]] = []
    for row in sorted(range(len(motions)), key=lambda row: len(motions[row])):
        if batches and (len(batches[-1]) + 1) * len(motions[row]) <= FRAMES_TOGETHER:
            batches[-1].append(row)
        else:
            batches.append([row])
    return batches


def _padded(motions: Sequence[Motion]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Rotations [row, time, 13, 4] and masks [row, time, 13]; padding comes last, and the network is causal."""
    longest = max(len(motion) for motion in motions)
    rotations = np.zeros((len(motions), longest, len(JOINTS), 4), np.float32)
    rotations[..., 3] = 1.0
    mask = np.zeros((len(motions), longest, len(JOINTS)), np.float32)
    for row, motion in enumerate(motions):
        rotations[row, : len(motion)], mask[row, : len(motion)] = motion.rotations, motion.mask
    return rotations, mask
