"""Controls: what can be had without learning anything of movement. A network worth the name beats all of them.

Each is fitted to the training clips of a fold, like everything else.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS, emotion_index
from fervor.rotations import angle_between
from fervor.skeletons.rig import UPPER_BODY
from fervor_export.clip import RATE_HZ, Clip

Floats = npt.NDArray[np.float64]

LEAST = 8
"""Clips of an emotion from which a line of its own is fitted; else it has the line of all."""


def emotion_mean(train: Sequence[Clip], test: Sequence[Clip]) -> Floats:
    """The mean training intensity of each clip's emotion; that of all where the emotion was not learned from."""
    target = _intensities(train)
    emotions = np.asarray([clip.emotion for clip in train])
    means = {emotion: float(target[emotions == emotion].mean()) for emotion in np.unique(emotions).tolist()}
    return np.asarray([means.get(clip.emotion, float(target.mean())) for clip in test])


def mean_speed(train: Sequence[Clip], test: Sequence[Clip]) -> Floats:
    """One line through mean joint speed and intensity."""
    slope, start = _line(speeds(train), _intensities(train))
    return np.clip(start + slope * speeds(test), 0.0, 1.0)


def mean_speed_by_emotion(train: Sequence[Clip], test: Sequence[Clip]) -> Floats:
    """A line for each emotion: sadness is slow, so one line for all would be a straw man."""
    speed, target = speeds(train), _intensities(train)
    emotions = np.asarray([clip.emotion for clip in train])
    common = _line(speed, target)
    lines = {
        emotion: _line(speed[mine], target[mine]) if mine.sum() >= LEAST else common
        for emotion in EMOTIONS
        for mine in [emotions == emotion]
    }
    asked = speeds(test)
    chosen = np.asarray([lines[clip.emotion] for clip in test]).reshape(len(test), 2)
    return np.clip(chosen[:, 1] + chosen[:, 0] * asked, 0.0, 1.0)


def speeds(clips: Sequence[Clip]) -> Floats:
    """Mean angular speed of the observed joints of the upper body [clip], rad/s; 0 where nothing was observed."""
    return np.asarray([_speed(clip) for clip in clips])


def other_emotions(clips: Sequence[Clip], *, seed: int) -> npt.NDArray[np.intp] | None:
    """For each clip the index of another emotion that the data has [clip]; None where it has one only.

    What a network says under a wrong label shows how much of its success is the label.
    """
    present = sorted({emotion_index(clip.emotion) for clip in clips})
    if len(present) < 2:
        return None
    random = np.random.default_rng(seed)
    own = np.asarray([present.index(emotion_index(clip.emotion)) for clip in clips])
    away = random.integers(1, len(present), len(clips))
    return np.asarray(present)[(own + away) % len(present)]


def _speed(clip: Clip) -> float:
    upper = list(UPPER_BODY)
    turned = angle_between(clip.rotations[:-1, upper].astype(np.float64), clip.rotations[1:, upper].astype(np.float64))
    seen = clip.mask[:-1, upper] & clip.mask[1:, upper]
    return float(turned[seen].mean() * RATE_HZ) if seen.any() else 0.0


def _intensities(clips: Sequence[Clip]) -> Floats:
    return np.asarray([clip.intensity for clip in clips])


def _line(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and start of the least-squares line; level where x does not vary."""
    spread = float(x.var()) if len(x) else 0.0
    slope = float(((x - x.mean()) * (y - y.mean())).mean()) / spread if spread > 1e-12 else 0.0
    return slope, float(y.mean() - slope * x.mean())
