"""What a run learns from and is scored on: generated motion, or a data set on disk, with actors kept apart."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from fervor_export.clip import Clip
from fervor_export.data.dataset import CAST_CLIPS, SYNTHETIC, load_dataset
from fervor_export.synthetic import synthesise_dataset
from fervor_export.training import split_by_actor


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Clips of a run; no actor is on two sides."""

    description: str
    purpose: Literal["demo", "research"]
    everything: list[Clip] = field(repr=False)
    """All clips of the data set."""
    learn: list[Clip] = field(repr=False)
    validate: list[Clip] = field(repr=False)
    test: list[Clip] = field(repr=False)
    """Seen neither by training nor by the choice of the epoch."""

    @property
    def seen(self) -> list[Clip]:
        """Training and validation clips, copies not counted, in the order of the data set."""
        ours = {id(clip) for clip in (*self.learn, *self.validate)}
        return [clip for clip in self.everything if id(clip) in ours]


def gather(source: str, *, clips: int, seed: int, progress: Callable[[int, int], None] = lambda *_: None) -> Material:
    """The clips of `source`: "synthetic", or what `load_dataset` takes.

    Clips recognised as neutral have no intensity and are left out of data sets. A manifest's own split is kept.

    Raises:
        DataError: the data set can't be used, or has fewer than three actors and no split of its own.
    """
    data = load_dataset(source, progress=progress, clips=clips, seed=seed)
    if source == SYNTHETIC:
        learn, validate = split_by_actor(data.clips, seed=seed)
        return Material(data.description, data.purpose, data.clips, learn, validate, _another_cast(clips, seed))
    intense = set(map(id, data.intense))
    given = {name: [clip for clip in part if id(clip) in intense] for name, part in data.splits.items()}
    if given.get("train") and given.get("test"):
        rest, test = given["train"], given["test"]
    else:
        rest, test = split_by_actor(data.intense, seed=seed)
    learn, validate = (rest, given["validation"]) if given.get("validation") else split_by_actor(rest, seed=seed)
    return Material(data.description, data.purpose, data.clips, learn, validate, test)


def _another_cast(clips: int, seed: int) -> list[Clip]:
    """Synthetic clips of actors that those to learn from don't show."""
    casts = -(-clips // CAST_CLIPS)
    return synthesise_dataset(clips=min(clips, CAST_CLIPS), seed=1000 * seed + casts)
