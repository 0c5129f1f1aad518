"""What a run learns from and is scored on: generated motion, or a data set on disk, with actors kept apart."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from fervor_export.clip import Clip
from fervor_export.data.dataset import CAST_CLIPS, SYNTHETIC, Dataset, load_dataset
from fervor_export.recipe import Recipe
from fervor_export.synthetic import synthesise_dataset
from fervor_export.training import sides, split_by_actor


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Clips of a run; no actor is on two sides."""

    description: str
    purpose: Literal["demo", "research"]
    everything: list[Clip] = field(repr=False)
    """All clips of the data set."""
    learn: list[Clip] = field(repr=False)
    """The copies that a recipe asks for are not among them."""
    validate: list[Clip] = field(repr=False)
    """For the choice of the epoch; none where the recipe keeps the last."""
    test: list[Clip] = field(repr=False)
    """Seen neither by training nor by the choice of the epoch; none where folds judge the recipe."""

    @property
    def seen(self) -> list[Clip]:
        """Training and validation clips, copies not counted, in the order of the data set."""
        ours = {id(clip) for clip in (*self.learn, *self.validate)}
        return [clip for clip in self.everything if id(clip) in ours]

    @classmethod
    def whole(cls, data: Dataset, recipe: Recipe, *, seed: int) -> "Material":
        """All clips to learn from, for a network whose recipe was judged by folds.

        Raises:
            DataError: fewer than two actors, where the recipe chooses the epoch by some.
        """
        learn, validate = sides(data.clips, recipe, seed=seed)
        return cls(data.description, data.purpose, data.clips, learn, validate, [])


def gather(
    source: str, recipe: Recipe, *, clips: int, seed: int, progress: Callable[[int, int], None] = lambda *_: None
) -> Material:
    """The clips of `source`: "synthetic", or what `load_dataset` takes; some actors are kept for the test.

    A manifest's own split is kept.

    Raises:
        DataError: the data set can't be used, or has too few actors and no split of its own.
    """
    data = load_dataset(source, progress=progress, clips=clips, seed=seed)
    given = data.splits
    if source == SYNTHETIC:
        rest, test = data.clips, _another_cast(clips, seed)
    elif given.get("train") and given.get("test"):
        rest, test = given["train"], given["test"]
    else:
        rest, test = split_by_actor(data.clips, seed=seed)
    if not given.get("validation"):
        learn, validate = sides(rest, recipe, seed=seed)
    elif recipe.keep == "last":
        learn, validate = [*rest, *given["validation"]], []
    else:
        learn, validate = rest, given["validation"]
    return Material(data.description, data.purpose, data.clips, learn, validate, test)


def _another_cast(clips: int, seed: int) -> list[Clip]:
    """Synthetic clips of actors that those to learn from don't show."""
    casts = -(-clips // CAST_CLIPS)
    return synthesise_dataset(clips=min(clips, CAST_CLIPS), seed=1000 * seed + casts)
