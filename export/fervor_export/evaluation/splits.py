"""Folds: which clips are learned from and which are judged by.

Rules. What is split is recordings, or actors, never clips: copies of a recording (mirrored, another 30 Hz phase, the
same file twice under two names) share its `name` or are found by `duplicates`, and stay on one side. Folds are made
before anything is augmented, so a copy is only ever made of a clip that is learned from. `assert_disjoint` proves it
for what is really trained on, copies included.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fervor.errors import DataError
from fervor_export.clip import Clip

MOST_ACTORS = 10
"""With more actors than this, each fold leaves out several of them."""

Unit = Literal["recording", "actor"]


@dataclass(frozen=True, slots=True)
class Fold:
    """Places of clips in the data set."""

    train: tuple[int, ...]
    test: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Split:
    """Folds that together judge every clip once."""

    unit: Unit
    """What no fold has on both sides."""
    folds: tuple[Fold, ...]

    def __iter__(self) -> Iterator[Fold]:
        return iter(self.folds)

    def __len__(self) -> int:
        return len(self.folds)


def by_recording(
    clips: Sequence[Clip], *, folds: int = 5, seed: int = 0, same: Mapping[str, str] | None = None
) -> Split:
    """Folds of whole recordings, the paper's protocol without its leak; each fold has its share of every emotion.

    Args:
        clips: the data set, not augmented.
        folds: how many.
        seed: of the order in which recordings are dealt.
        same: recording -> the recording it repeats (`duplicates.groups`); such recordings stay together.

    Raises:
        DataError: fewer recordings than folds.
    """
    groups = [(same or {}).get(clip.name, clip.name) for clip in clips]
    emotion = {group: clip.emotion for group, clip in reversed(list(zip(groups, clips, strict=True)))}
    if not 2 <= folds <= len(emotion):
        raise DataError(f"{len(emotion)} recordings can't be split into {folds} folds; expected 2 to as many folds")
    random = np.random.default_rng(seed)
    shuffled = [sorted(emotion)[index] for index in random.permutation(len(emotion))]
    dealt = {group: place % folds for place, group in enumerate(sorted(shuffled, key=emotion.__getitem__))}
    return _folds("recording", [dealt[group] for group in groups], folds)


def by_actor(
    clips: Sequence[Clip], *, most: int = MOST_ACTORS, seed: int = 0, same: Mapping[str, str] | None = None
) -> Split:
    """Leave one actor out; where there are more than `most` actors, as many folds of several actors.

    A recording that repeats one of a judged actor under another actor's name (`same`) is learned from in no fold that
    judges the first.

    Raises:
        DataError: fewer than two actors.
    """
    counts = Counter(clip.actor for clip in clips)
    if len(counts) < 2:
        raise DataError(f"{len(clips)} clips of {len(counts)} actor can't be split by actor; expected two or more")
    folds = min(len(counts), most)
    shuffled = [sorted(counts)[index] for index in np.random.default_rng(seed).permutation(len(counts))]
    loads, place = [0] * folds, {}
    for actor in sorted(shuffled, key=lambda actor: -counts[actor]):
        place[actor] = loads.index(min(loads))
        loads[place[actor]] += counts[actor]
    split = _folds("actor", [place[clip.actor] for clip in clips], folds)
    return Split("actor", tuple(_without_repeats(fold, clips, same) for fold in split)) if same else split


def as_given(
    clips: Sequence[Clip], train: Sequence[Clip], test: Sequence[Clip], *, same: Mapping[str, str] | None = None
) -> Split:
    """The one fold that a data set brings along, less what repeats a judged recording under another name.

    Args:
        clips: the data set.
        train: those of its clips that are learned from.
        test: those that are judged.
        same: recording -> the recording it repeats (`duplicates.groups`).

    Raises:
        DataError: a recording is on both sides.
    """
    assert_disjoint(train, test)
    sides = {id(clip) for clip in train}, {id(clip) for clip in test}
    learned, judged = (tuple(index for index, clip in enumerate(clips) if id(clip) in side) for side in sides)
    return Split("recording", (_without_repeats(Fold(learned, judged), clips, same or {}),))


def assert_disjoint(train: Sequence[Clip], test: Sequence[Clip], *, unit: Unit = "recording") -> None:
    """That no recording, or no actor, stands on both sides; to be asked of what is trained on, copies included.

    Raises:
        DataError: it does; says which.
    """
    sides = [{clip.name for clip in side} for side in (train, test)]
    kind = "recordings"
    if unit == "actor" and not sides[0] & sides[1]:
        sides, kind = [{clip.actor for clip in side} for side in (train, test)], "actors"
    if both := sorted(sides[0] & sides[1]):
        shown = ", ".join(both[:3]) + (", …" if len(both) > 3 else "")
        raise DataError(f"a leak: {len(both)} {kind} are both trained on and judged by ({shown})")


def _folds(unit: Unit, place: Sequence[int], folds: int) -> Split:
    """Folds from the one in which each clip is judged."""
    where = np.asarray(place)
    return Split(
        unit,
        tuple(
            Fold(tuple(np.flatnonzero(where != fold).tolist()), tuple(np.flatnonzero(where == fold).tolist()))
            for fold in range(folds)
        ),
    )


def _without_repeats(fold: Fold, clips: Sequence[Clip], same: Mapping[str, str]) -> Fold:
    judged = {same.get(clips[index].name, clips[index].name) for index in fold.test}
    train = (index for index in fold.train if same.get(clips[index].name, clips[index].name) not in judged)
    return Fold(tuple(train), fold.test)
