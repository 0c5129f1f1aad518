"""What there is to say about a data set in numbers."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fervor.emotions import EMOTIONS
from fervor_export.clip import Clip
from fervor_export.data.dataset import Dataset
from fervor_export.data.label import NEUTRAL
from fervor_export.evaluation.ceiling import ceiling
from fervor_export.evaluation.duplicates import groups

CEILING_SOURCE = (
    "The largest correlation any estimate can have with shares of n observers: √(1 - mean(y(1-y)/(n-1)) / var(y)), the "
    "root of the labels' reliability (Kuder & Richardson 1937, formula 21; Spearman 1904 for the root)."
)


@dataclass(frozen=True, slots=True)
class Group:
    """Clips of one emotion, or of one actor; intensities without neutral ones where the group is an actor's."""

    name: str
    clips: int
    others: int
    """Actors of an emotion, or emotions of an actor."""
    minutes: float
    mean: float | None
    """Of the intensity; None where no clip has one."""
    deviation: float | None
    ceiling: float | None
    """Of the correlation with labels of so few observers; None where that can't be said."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A data set in numbers. Counts are by name."""

    description: str
    sha256: str
    clips: int
    recordings: int
    hours: float
    emotions: tuple[Group, ...]
    """Without neutral."""
    neutral: Group | None
    """Apart: recognised as neutral is not an intensity."""
    actors: tuple[Group, ...]
    ceiling: float | None
    """Over all clips but the neutral ones."""
    observers: dict[str, int]
    """Clips by the number of observers; "unknown" where nobody says."""
    rates: dict[str, int]
    """Recordings by frames a second, rounded."""
    skeletons: dict[str, int]
    splits: dict[str, int]
    seconds: tuple[float, float, float]
    """Shortest, median and longest clip."""
    t_poses: int
    """Recordings that began with a T-pose, which was dropped."""
    unlabelled: int
    """Recordings that can be read but have no label."""
    repeats: dict[str, str]
    """Recordings that move nearly as another one does, and that one: folds must keep them together."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def summarise(data: Dataset) -> Summary:
    """A data set in numbers."""
    clips = data.clips
    seconds = np.array([clip.seconds for clip in clips]) if clips else np.zeros(1)
    by_emotion = [_group(name, clips, lambda c: c.emotion, lambda c: c.actor) for name in EMOTIONS]
    present = [group for group in by_emotion if group.clips]
    actors = sorted({clip.actor for clip in clips})
    repeated = groups(clips) if clips else {}
    return Summary(
        description=data.description,
        sha256=data.sha256,
        clips=len(clips),
        recordings=len({clip.name for clip in clips}),
        hours=float(sum(clip.seconds for clip in clips) / 3600),
        emotions=tuple(group for group in present if group.name != NEUTRAL),
        neutral=next((group for group in present if group.name == NEUTRAL), None),
        actors=tuple(_group(name, clips, lambda c: c.actor, lambda c: c.emotion) for name in actors),
        ceiling=noise_ceiling(data.intense),
        observers=_counts(str(clip.observers or "unknown") for clip in clips),
        rates=_counts(f"{take.motion.rate_hz:.0f}" for take in data.takes),
        skeletons=_counts(take.motion.skeleton for take in data.takes),
        splits={name: len(part) for name, part in data.splits.items()},
        seconds=(float(seconds.min()), float(np.median(seconds)), float(seconds.max())),
        t_poses=sum(take.motion.t_poses > 0 for take in data.takes),
        unlabelled=sum(take.entry.label is None for take in data.takes),
        repeats={name: first for name, first in sorted(repeated.items()) if name != first},
    )


def noise_ceiling(clips: Sequence[Clip]) -> float | None:
    """The largest correlation with the clips' labels; None where an n is unknown, or nothing can be said."""
    observers = [clip.observers for clip in clips if clip.observers is not None]
    if not clips or len(observers) < len(clips):
        return None
    return ceiling(np.array([clip.intensity for clip in clips]), np.array(observers))


def _group(name: str, clips: Sequence[Clip], key: Callable[[Clip], str], other: Callable[[Clip], str]) -> Group:
    mine = [clip for clip in clips if key(clip) == name]
    rated = [clip for clip in mine if clip.emotion != NEUTRAL or name == NEUTRAL]
    shares = np.array([clip.intensity for clip in rated])
    return Group(
        name=name,
        clips=len(mine),
        others=len({other(clip) for clip in mine}),
        minutes=float(sum(clip.seconds for clip in mine) / 60),
        mean=float(shares.mean()) if rated else None,
        deviation=float(shares.std()) if rated else None,
        ceiling=noise_ceiling(rated),
    )


def _counts(words: Any) -> dict[str, int]:
    return dict(sorted(Counter(words).items(), key=lambda item: (-item[1], item[0])))
