"""What a step feeds the model, and what becomes of what the model says: for steps one by one, and for many at once."""

from collections.abc import Sequence
from math import isfinite

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.posing import Poses, arrived, between, on_the_way
from fervor.errors import EngineError
from fervor.model import Floats
from fervor.session.events import Step


def poses_at(steps: Sequence[Step], old: Poses, new: Poses) -> tuple[Floats, Floats]:
    """Rotations and mask at steps between these poses [step]; see `between`."""
    fraction, held = [step.fraction for step in steps], [step.held for step in steps]
    if True not in held:
        if max(fraction) < 1.0:
            return on_the_way(old, new, np.array(fraction))
        if min(fraction) >= 1.0:  # as of sensors that keep the grid's time
            return arrived(new)
    return between(old, new, np.array(fraction), np.array(held))


def emotions_at(steps: Sequence[Step]) -> Floats:
    """The emotion vectors that hold at steps: [step, emotion]."""
    labels = b"".join([step.label.vector.tobytes() for step in steps])  # sooner done than np.stack
    return np.frombuffer(labels, np.float32).reshape(len(steps), len(EMOTIONS))


def spoken(intensity: Floats, by_emotion: Floats) -> npt.NDArray[np.float64]:
    """Intensity [...], and that under every emotion [..., emotion], in one: [..., 1 + emotion].

    Raises:
        EngineError: an intensity that is not finite.
    """
    if not isfinite(np.add.reduce(intensity, axis=None)):  # one that is not makes the sum so
        raise EngineError("the model gave an intensity that is not finite; the body starts anew")
    return np.concatenate((intensity[..., None], by_emotion), axis=-1, dtype=np.float64)


def blend(by_lane: npt.NDArray[np.float64], weight: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """What lanes say, weighted into one.

    Args:
        by_lane: [..., lane, k].
        weight: [..., lane].

    Returns:
        [..., k].
    """
    blended: npt.NDArray[np.float64] = np.add.reduce(by_lane * weight[..., None], axis=-2)
    return blended
