"""Clips to training batches: streams of one or more clips, augmented, of similar length, padded.

Everything a loss needs is said per frame: the emotion, the intensity expected and a weight, zero where nothing is
expected (padding, the first second of a clip, the way from one clip to the next). The network is causal and padding
comes last, so padded frames need no packing: they change nothing before them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from fervor.emotions import emotion_index
from fervor.rotations import from_rotvec, multiply, slerp
from fervor.skeletons.rig import JOINTS
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.recipe import Recipe

LEGS, WRISTS, TRUNK = (9, 10, 11, 12), (5, 8), (0, 1)
"""Joints that sensors lose together."""

BLEND_S = 0.4
"""Time in which a body moves from the end of one clip to the beginning of the next."""

LEAST_S = 2.0
"""What is left of a clip that is cropped."""

OBSERVERS = 10.0
"""Observers at which a clip has half the weight it could have: with fewer, the label is mostly chance."""

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """Motion with what is expected at each frame."""

    rotations: Floats  # [frame, 13, 4]
    mask: npt.NDArray[np.bool_]  # [frame, 13]
    emotion: npt.NDArray[np.int64]  # [frame]
    target: Floats  # [frame]
    weight: Floats  # [frame], sums to each clip's weight over the clip's frames

    def __len__(self) -> int:
        return len(self.rotations)

    def until(self, stop: int) -> "Stream":
        """The first `stop` frames."""
        return Stream(
            self.rotations[:stop], self.mask[:stop], self.emotion[:stop], self.target[:stop], self.weight[:stop]
        )

    def then(self, other: "Stream") -> "Stream":
        """This stream and then another."""
        return Stream(
            np.concatenate([self.rotations, other.rotations]),
            np.concatenate([self.mask, other.mask]),
            np.concatenate([self.emotion, other.emotion]),
            np.concatenate([self.target, other.target]),
            np.concatenate([self.weight, other.weight]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Streams side by side, padded to the longest."""

    rotations: Tensor  # [batch, time, 13, 4]
    mask: Tensor  # [batch, time, 13] float
    emotion: Tensor  # [batch, time] int64
    target: Tensor  # [batch, time]
    weight: Tensor  # [batch, time]


def plain_stream(clip: Clip, recipe: Recipe) -> Stream:
    """A clip as it is."""
    frames = clip.frames
    weight = np.zeros(frames, np.float32)
    first = frames - 1 if recipe.loss_at == "last" else min(round(recipe.settle_s * RATE_HZ), frames - 1)
    weight[first:] = _reliability(clip) / (frames - first)
    return Stream(
        clip.rotations,
        clip.mask,
        np.full(frames, emotion_index(clip.emotion)),
        np.full(frames, clip.intensity, np.float32),
        weight,
    )


def _reliability(clip: Clip) -> float:
    return 1.0 if clip.observers is None else clip.observers / (clip.observers + OBSERVERS)


def training_batches(clips: Sequence[Clip], recipe: Recipe, random: np.random.Generator) -> Iterator[Batch]:
    """One epoch: every clip at least once, in random company."""
    order = random.permutation(len(clips))
    streams = [_augmented(clips, int(index), recipe, random) for index in order]
    pool = recipe.batch_size * 8  # sorted by length within, so that little is padded; mixed between
    batches = [
        streams_of_length[start : start + recipe.batch_size]
        for pooled in range(0, len(streams), pool)
        for streams_of_length in [sorted(streams[pooled : pooled + pool], key=len)]
        for start in range(0, len(streams_of_length), recipe.batch_size)
    ]
    for index in random.permutation(len(batches)):
        yield pad(batches[index])


def pad(streams: Sequence[Stream]) -> Batch:
    """Streams as one batch; padded frames are unobserved and weigh nothing."""
    shape = (len(streams), max(map(len, streams)))
    rotations = np.zeros((*shape, len(JOINTS), 4), np.float32)
    mask = np.zeros((*shape, len(JOINTS)), np.float32)
    emotion = np.zeros(shape, np.int64)
    target, weight = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for row, stream in enumerate(streams):
        frames = len(stream)
        rotations[row, :frames], mask[row, :frames] = stream.rotations, stream.mask
        emotion[row, :frames], target[row, :frames] = stream.emotion, stream.target
        weight[row, :frames] = stream.weight
    return Batch(*map(torch.from_numpy, (rotations, mask, emotion, target, weight)))


# --- augmentation ---------------------------------------------------------------------------------------------------


def _augmented(clips: Sequence[Clip], index: int, recipe: Recipe, random: np.random.Generator) -> Stream:
    stream = plain_stream(_cropped(clips[index], recipe, random), recipe)
    longest = round(recipe.longest_s * RATE_HZ)
    while len(stream) < longest and random.random() < recipe.join:
        other = _cropped(clips[int(random.integers(len(clips)))], recipe, random)
        stream = _joined(stream, plain_stream(other, recipe))
    return _degraded(stream.until(longest), recipe, random)


def _cropped(clip: Clip, recipe: Recipe, random: np.random.Generator) -> Clip:
    """The clip from some frame on."""
    room = clip.frames - round(LEAST_S * RATE_HZ)
    if room <= 0 or random.random() >= recipe.crop:
        return clip
    start = int(random.integers(room + 1))
    return replace(clip, rotations=clip.rotations[start:], mask=clip.mask[start:])


def _joined(before: Stream, after: Stream) -> Stream:
    """One stream, the body moving over in `BLEND_S`; nothing is expected on the way."""
    steps = round(BLEND_S * RATE_HZ)
    share = np.linspace(0, 1, steps + 2, dtype=np.float32)[1:-1, None]
    way = slerp(before.rotations[-1:], after.rotations[:1], share)
    between = Stream(
        way,
        np.repeat((before.mask[-1] & after.mask[0])[None], steps, 0),
        np.repeat(after.emotion[:1], steps),
        np.repeat(after.target[:1], steps),
        np.zeros(steps, np.float32),
    )
    return before.then(between).then(after)


def _degraded(stream: Stream, recipe: Recipe, random: np.random.Generator) -> Stream:
    """Joints lost for the whole stream, and axes mounted a little askew."""
    lost = random.random(len(JOINTS)) < recipe.joint_dropout
    for joints, rate in ((LEGS, recipe.leg_dropout), (WRISTS, recipe.wrist_dropout), (TRUNK, recipe.trunk_dropout)):
        if random.random() < rate:
            lost[list(joints)] = True
    rotations = stream.rotations
    if recipe.bind_noise_deg:
        turn = random.normal(0, np.deg2rad(recipe.bind_noise_deg), (len(JOINTS), 3)).astype(np.float32)
        rotations = multiply(rotations, from_rotvec(turn))
    return replace(stream, rotations=rotations, mask=stream.mask & ~lost)
