"""What a run learns from and is scored on: generated motion, or a data set on disk, with actors kept apart."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from fervor_export.clip import Clip
from fervor_export.data.dataset import load_dataset
from fervor_export.synthetic import synthesise_dataset
from fervor_export.training import split_by_actor

SYNTHETIC = "synthetic"
GENERATED = "procedurally generated expressive motion, no recordings of people"
"""What it is, in the words of the model's metadata."""
CAST_CLIPS = 1000
"""Synthetic clips of one cast of actors; more clips have more casts, and the finished network is scored on another."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Clips of a run; no actor is on two sides."""

    description: str
    purpose: Literal["demo", "research"]
    learn: list[Clip] = field(repr=False)
    validate: list[Clip] = field(repr=False)
    test: list[Clip] = field(repr=False)
    """Seen neither by training nor by the choice of the epoch."""

    @property
    def seen(self) -> list[Clip]:
        """Training and validation clips, copies not counted."""
        return [*self.learn, *self.validate]


def gather(source: str, *, clips: int, seed: int, progress: Callable[[int, int], None] = lambda *_: None) -> Material:
    """The clips of `source`: "synthetic", or what `load_dataset` takes.

    Clips recognised as neutral have no intensity and are left out of data sets. A manifest's own split is kept.

    Raises:
        DataError: the data set can't be used, or has fewer than three actors and no split of its own.
    """
    if source == SYNTHETIC:
        everything, test = _synthetic(clips, seed)
        learn, validate = split_by_actor(everything, seed=seed)
        return Material(
            "procedurally generated expressive motion, no recordings of people", "demo", learn, validate, test
        )
    data = load_dataset(source, progress=progress)
    intense = set(map(id, data.intense))
    given = {name: [clip for clip in part if id(clip) in intense] for name, part in data.splits.items()}
    if given.get("train") and given.get("test"):
        rest, test = given["train"], given["test"]
    else:
        rest, test = split_by_actor(data.intense, seed=seed)
    learn, validate = (rest, given["validation"]) if given.get("validation") else split_by_actor(rest, seed=seed)
    return Material(data.description, data.purpose, learn, validate, test)


def _synthetic(clips: int, seed: int) -> tuple[list[Clip], list[Clip]]:
    """Clips to train and validate on, and clips of another cast for the test."""
    casts = -(-clips // CAST_CLIPS)
    seeds = range(seed * 1000, seed * 1000 + casts + 1)  # runs with other seeds have other casts
    sizes = [CAST_CLIPS] * (casts - 1) + [clips - CAST_CLIPS * (casts - 1), min(clips, CAST_CLIPS)]
    *parts, test = (synthesise_dataset(clips=size, seed=cast) for cast, size in zip(seeds, sizes, strict=True))
    return [clip for part in parts for clip in part], test
