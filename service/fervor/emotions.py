"""The eleven emotions of the EBMDB, their order, and the emotion vector E of the paper (section III-B).

E is a probability vector over `EMOTIONS`: one-hot for a plain label, all zero for an unknown emotion. Sources that
speak of "happiness" or "angry" are understood; a name that is none of these is refused, never silently unknown.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from fervor.errors import InputError

EMOTIONS: tuple[str, ...] = (
    "amusement",
    "anger",
    "disgust",
    "fear",
    "joy",
    "neutral",
    "pride",
    "relief",
    "sadness",
    "shame",
    "surprise",
)
"""Order of the emotion axis in the model file and in `intensity_by_emotion`."""

UNKNOWN = "unknown"
"""The label of an emotion vector that is all zero."""

SYNONYMS: Mapping[str, str] = {
    "amused": "amusement",
    "angry": "anger",
    "disgusted": "disgust",
    "afraid": "fear",
    "fearful": "fear",
    "happiness": "joy",
    "happy": "joy",
    "calm": "neutral",
    "proud": "pride",
    "relieved": "relief",
    "sad": "sadness",
    "ashamed": "shame",
    "surprised": "surprise",
}
"""What face analysers and data sets call the same emotions."""

_INDEX = {name: index for index, name in enumerate(EMOTIONS)}


def emotion_index(name: str) -> int:
    """Position of `name` (or a synonym, any case) on the emotion axis.

    Raises:
        InputError: the name is none of the eleven emotions nor a synonym.
    """
    key = name.strip().lower()
    index = _INDEX.get(SYNONYMS.get(key, key))
    if index is None:
        raise InputError(f"emotion {name!r} is not known; expected one of {', '.join(EMOTIONS)}")
    return index


def emotion_vector(label: str | Mapping[str, float] | None) -> npt.NDArray[np.float32]:
    """The emotion vector of a label, a mapping from emotion to probability, or None.

    Returns:
        float32 [11]: one-hot for a label; the probabilities of a mapping, divided by their sum where that exceeds 1
        (analysers round); all zero for None, "unknown" or an empty mapping.

    Raises:
        InputError: an unknown name, or a probability that is negative or not finite.
    """
    if label is None or isinstance(label, str):
        return _one_hot(UNKNOWN if label is None else label).copy()
    vector = np.zeros(len(EMOTIONS), np.float64)  # [emotion]
    for name, share in label.items():
        if not (np.isfinite(share) and share >= 0.0):
            raise InputError(f"emotion {name!r} has the probability {share}; expected a finite number from 0 to 1")
        vector[emotion_index(name)] += share
    total = float(vector.sum())
    return (vector / total if total > 1.0 else vector).astype(np.float32)


@lru_cache(maxsize=256)
def _one_hot(label: str) -> npt.NDArray[np.float32]:
    """Of a plain label; some clients send theirs with every frame."""
    vector = np.zeros(len(EMOTIONS), np.float32)  # [emotion]
    if label != UNKNOWN:
        vector[emotion_index(label)] = 1.0
    return vector


def dominant_emotion(vector: npt.NDArray[np.float32]) -> str:
    """The label with the largest share of an emotion vector [11]; "unknown" where all are zero."""
    index = int(vector.argmax())
    return EMOTIONS[index] if vector[index] > 0.0 else UNKNOWN
