"""The emotion label of a body: a vector, a name, and how long it holds.

A plain label holds until it is changed. A probability vector comes from an analyser that may lose the face, so it
holds for `ANALYSER_TTL_S` unless the session says otherwise; after that the emotion is unknown.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.emotions import UNKNOWN, dominant_emotion, emotion_vector

ANALYSER_TTL_S = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Label:
    """An emotion vector and the instant (seconds, client clock) until which it holds; None: for ever."""

    vector: npt.NDArray[np.float32]  # [emotion]
    name: str
    until: float | None = None

    def at(self, time: float) -> "Label":
        """The label in force at `time`: this one, or unknown once it has expired."""
        return self if self.until is None or time <= self.until else NO_LABEL


NO_LABEL = Label(emotion_vector(None), UNKNOWN)


def make_label(emotion: str | Mapping[str, float], time: float, ttl: float | None) -> Label:
    """A label given at `time`.

    Args:
        emotion: a name, or a probability per emotion.
        time: seconds, client clock.
        ttl: seconds it holds; None for the default of its kind.

    Raises:
        InputError: an unknown emotion or an impossible probability.
    """
    vector = emotion_vector(emotion)
    if ttl is None and not isinstance(emotion, str):
        ttl = ANALYSER_TTL_S
    return Label(vector, dominant_emotion(vector), None if ttl is None else time + ttl)
