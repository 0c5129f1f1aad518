"""A clip: one labelled stretch of canonical motion, the unit that training, evaluation and folds work on."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.emotions import emotion_index
from fervor.errors import DataError
from fervor.skeletons.rig import JOINTS

RATE_HZ = 30.0
"""Frames a second of every clip."""


class Phase(NamedTuple):
    """Motion at 30 Hz that begins a fraction of a frame after a clip's."""

    rotations: npt.NDArray[np.float32]  # [frame, 13, 4] xyzw
    mask: npt.NDArray[np.bool_]  # [frame, 13]


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Motion of one body at 30 Hz with the emotion it was meant to show and how intensely it shows it.

    The intensity is the share of observers who recognise the intended emotion (section IV-A of the paper).

    Raises:
        DataError: shapes or an intensity that are not a clip's.
        InputError: an emotion that is not known.
    """

    rotations: npt.NDArray[np.float32] = field(repr=False)  # [frame, 13, 4] xyzw, local, rig C13
    mask: npt.NDArray[np.bool_] = field(repr=False)  # [frame, 13] True where observed
    emotion: str
    intensity: float  # in [0, 1]
    actor: str
    """Who moved: folds and validation never split an actor."""
    name: str
    """Which recording: copies of one recording share it."""
    observers: int | None = None
    """How many people the intensity is a share of; None where unknown."""
    phases: tuple[Phase, ...] = field(default=(), repr=False)
    """The recording's other phases, where it is fast enough to have some; `data.augment` makes clips of them."""

    def __post_init__(self) -> None:
        if self.rotations.ndim != 3 or self.rotations.shape[1:] != (len(JOINTS), 4) or not len(self.rotations):
            raise DataError(f"clip {self.name!r} has rotations {self.rotations.shape}; expected [frame, 13, 4]")
        if self.mask.shape != self.rotations.shape[:2]:
            raise DataError(f"clip {self.name!r} has a mask {self.mask.shape}; expected {self.rotations.shape[:2]}")
        if not 0.0 <= self.intensity <= 1.0:
            raise DataError(f"clip {self.name!r} has the intensity {self.intensity}; expected a number from 0 to 1")
        emotion_index(self.emotion)

    @property
    def frames(self) -> int:
        """How many frames the clip has."""
        return len(self.rotations)

    @property
    def seconds(self) -> float:
        """How long the clip is."""
        return self.frames / RATE_HZ


def digest(clips: Iterable[Clip]) -> str:
    """SHA-256 of clips, in hexadecimal: motion, masks, labels and order."""
    sha = hashlib.sha256()
    for clip in clips:
        sha.update(f"{clip.name}\0{clip.actor}\0{clip.emotion}\0{clip.intensity!r}\0{clip.observers}\0".encode())
        sha.update(clip.rotations.astype(np.float32).tobytes())
        sha.update(clip.mask.astype(np.bool_).tobytes())
    return sha.hexdigest()
