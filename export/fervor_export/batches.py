"""Clips to training batches: streams of one or more clips, augmented, of similar length, padded.

Everything a loss needs is said per frame: the emotion, the intensity expected and a weight, zero where nothing is
expected (padding, the first second of a clip, the way from one clip to the next). The network is causal and padding
comes last, so padded frames need no packing: they change nothing before them. A batch goes through the network in
groups of streams of nearly equal length, and the weights move once for all of them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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

POOL = 8
"""Batches whose streams are sorted by length together: more would pad less, and mix lengths less."""

GROUP = 32
"""Streams that go through the network together. Their states stay in a core's cache: 71 GFLOP/s where a whole batch of
256 had 46 and a packed sequence, which oneDNN does not take, less than 5, all in one run; and less is padded."""

Floats = npt.NDArray[np.float32]
Rows = npt.NDArray[np.intp]


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
    lengths: Rows  # [batch] frames of each stream

    def groups(self) -> Iterator["Batch"]:
        """The batch by `GROUP` streams, each group padded to its own longest."""
        for part in group(self.lengths):
            yield Batch(
                part.of(self.rotations),
                part.of(self.mask),
                part.of(self.emotion),
                part.of(self.target),
                part.of(self.weight),
                part.lengths,
            )


class Group(NamedTuple):
    """Streams of a batch that go through the network together."""

    rows: slice
    lengths: Rows

    def of(self, tensor: Tensor) -> Tensor:
        """The group's part [group, time, ...] of a batch's [batch, time, ...]."""
        return tensor[self.rows, : int(self.lengths.max())].contiguous()


def group(lengths: Rows) -> Iterator[Group]:
    """The groups of a batch whose streams have these lengths [batch]."""
    for first in range(0, len(lengths), GROUP):
        rows = slice(first, first + GROUP)
        yield Group(rows, lengths[rows])


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


def training_batches(clips: Sequence[Clip], recipe: Recipe, *, seed: int, epoch: int) -> Iterator[Batch]:
    """One epoch: every clip at least once, in random company.

    All chance follows from seed and epoch, so that training can go on at any epoch as if it had never ended.
    """
    random = np.random.default_rng((seed, epoch, 1))
    streams = [_augmented(clips, index, recipe, random) for index in range(len(clips))]
    for rows in arrange(list(map(len, streams)), recipe.batch_size, seed=seed, epoch=epoch):
        yield pad([streams[row] for row in rows])


def arrange(lengths: Sequence[int], batch_size: int, *, seed: int, epoch: int) -> list[Rows]:
    """Which streams [batch] stand together in each batch of an epoch.

    Streams are shuffled and cut into batches of equal size, give or take one: a small rest would be the longest ones,
    and each of them would count for more. Pools of up to `POOL` batches are then sorted by length.
    """
    random = np.random.default_rng((seed, epoch))
    shuffled = np.array_split(random.permutation(len(lengths)), batches_an_epoch(len(lengths), batch_size))
    sizes, batches = np.asarray(lengths), list[Rows]()
    for together in np.array_split(np.arange(len(shuffled)), -(-len(shuffled) // POOL)):
        parts = [shuffled[index] for index in together]
        pool = np.concatenate(parts)
        by_length = pool[np.argsort(sizes[pool], kind="stable")]
        batches += np.split(by_length, np.cumsum([len(part) for part in parts])[:-1])
    return [batches[index] for index in random.permutation(len(batches))]


def batches_an_epoch(clips: int, batch_size: int) -> int:
    """How many batches `arrange` makes."""
    return -(-clips // batch_size)


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
    lengths = np.asarray([len(stream) for stream in streams])
    return Batch(
        torch.from_numpy(rotations),
        torch.from_numpy(mask),
        torch.from_numpy(emotion),
        torch.from_numpy(target),
        torch.from_numpy(weight),
        lengths,
    )


# --- augmentation ---------------------------------------------------------------------------------------------------


def _augmented(clips: Sequence[Clip], index: int, recipe: Recipe, random: np.random.Generator) -> Stream:
    longest = round(recipe.longest_s * RATE_HZ)
    stream = plain_stream(cut(_cropped(clips[index], recipe, random), recipe), recipe)
    while len(stream) < longest and random.random() < recipe.join:
        other = _cropped(clips[int(random.integers(len(clips)))], recipe, random)
        stream = _joined(stream, plain_stream(other, recipe))
    return _degraded(stream.until(longest), recipe, random)


def cut(clip: Clip, recipe: Recipe) -> Clip:
    """What is learned from of a clip that is too long: its beginning, or its end if only that is asked for."""
    longest = round(recipe.longest_s * RATE_HZ)
    if clip.frames <= longest:
        return clip
    part = slice(clip.frames - longest, None) if recipe.loss_at == "last" else slice(longest)
    return replace(clip, rotations=clip.rotations[part], mask=clip.mask[part])


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
