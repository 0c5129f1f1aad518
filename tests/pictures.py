"""Recordings to draw: what a stream would have said of a body that waves."""

from collections.abc import Sequence

import numpy as np

from fervor.cli.picture.trace import Trace
from fervor.emotions import EMOTIONS
from fervor.protocol.messages import Estimate, ModelInfo

MODEL = ModelInfo(
    name="fervor-demo",
    version="1.0",
    purpose="demo",
    sha256="0" * 64,
    rate_hz=30.0,
    emotions=EMOTIONS,
    thresholds=dict.fromkeys(EMOTIONS, 0.5) | {"joy": 0.6, "unknown": 0.4},
)

RATE_HZ = 30.0


def estimate(number: int, intensity: float | None = 0.3, **fields) -> Estimate:
    """The estimate of frame `number` at 30 Hz."""
    strong = None if intensity is None else "strong" if intensity >= 0.6 else "weak"
    given = {"emotion": "joy", "status": "ok", "level": strong} | fields
    return Estimate(**{"body": "0", "seq": number, "t": number / RATE_HZ, "intensity": intensity} | given)


def waving(frames: int) -> np.ndarray:
    """Poses [frame, 13, 4]: the left arm goes up and down, all else hangs."""
    poses = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 13, 1))
    angle = np.pi * np.abs(np.sin(np.arange(frames) / 20.0))
    poses[:, 3] = np.stack([np.zeros(frames), np.zeros(frames), np.sin(angle / 2), np.cos(angle / 2)], axis=-1)
    return poses


def trace(estimates: Sequence[Estimate], *, poses: np.ndarray | None = None, name: str = "wave.bvh") -> Trace:
    """A trace with a frame for each estimate."""
    times = np.asarray([one.t for one in estimates])
    return Trace(name, MODEL, estimates, times, waving(len(times)) if poses is None else poses, 0.05)
