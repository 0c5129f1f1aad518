"""Which clips a finished model has not learned from. A run directory says from which recordings and actors it has.

Training writes `learned_from.json` beside the checkpoint, with validation clips among what was learned from: the epoch
was chosen by them. A clip is held out if neither its recording, nor one that it repeats under another name, nor its
actor is there. A model that does not say what it learned from can be judged only where that can't matter: a demo model
learned from generated motion, so any recording of people is new to it.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fervor.errors import DataError
from fervor_export.clip import Clip
from fervor_export.evaluation import duplicates

NAME = "learned_from.json"


@dataclass(frozen=True, slots=True)
class LearnedFrom:
    """What training or the choice of its epoch has seen."""

    recordings: frozenset[str]
    actors: frozenset[str]


def write_learned_from(clips: Iterable[Clip], directory: Path) -> None:
    """Write down what a run learned from: training and validation clips."""
    seen = list(clips)
    content = {"recordings": sorted({clip.name for clip in seen}), "actors": sorted({clip.actor for clip in seen})}
    directory.mkdir(parents=True, exist_ok=True)
    (directory / NAME).write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def read_learned_from(directory: Path) -> LearnedFrom | None:
    """What a run directory says; None where it says nothing.

    Raises:
        DataError: the file is not what `write_learned_from` writes.
    """
    path = directory / NAME
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return LearnedFrom(frozenset(content["recordings"]), frozenset(content["actors"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path} does not list recordings and actors: {error}") from error


def held_out(clips: Sequence[Clip], learned: LearnedFrom | None, *, demo: bool, procedural: bool) -> list[Clip]:
    """Clips that a model has not learned from, nor their actors.

    Args:
        clips: candidates.
        learned: what it learned from, if that is known.
        demo: whether it learned from generated motion only.
        procedural: whether the candidates are generated.

    Raises:
        DataError: nothing is held out, or nobody can know.
    """
    if learned is None:
        if demo and not procedural:
            return list(clips)
        raise DataError(f"the model does not say what it learned from (no {NAME} beside it): "
                        "nothing is known to be new to it")  # fmt: skip
    same = duplicates.groups(clips)
    tainted = {same.get(clip.name, clip.name) for clip in clips if clip.name in learned.recordings}
    kept = [
        clip
        for clip in clips
        if clip.actor not in learned.actors and same.get(clip.name, clip.name) not in tainted | learned.recordings
    ]
    if not kept:
        raise DataError(f"the model has learned from the recordings or the actors of all {len(clips)} clips; "
                        "expected some that are new to it")  # fmt: skip
    return kept
