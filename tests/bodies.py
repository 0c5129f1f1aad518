"""Things that tests of the live path share: real terms of the real model, and motion to feed it."""

from functools import cache

import numpy as np

from fervor.model import Model, default_model_path
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.messages import Limits, ModelInfo
from fervor.session.body import Terms
from fervor.session.events import Source
from fervor.session.host import Host
from fervor.skeletons.catalog import skeleton


@cache
def model() -> Model:
    """The packaged model, loaded once."""
    return Model.load(default_model_path())


def terms(name: str = "c13", **changes) -> Terms:
    """Terms as a session on skeleton `name` would agree on them."""
    known = skeleton(name)
    return Terms(metadata=model().metadata, source=Source(known, known.axes), **changes)


def host(claim, **limits) -> Host:
    """A service to have a session in."""
    metadata = model().metadata
    info = ModelInfo(
        name=metadata.name,
        version=metadata.version,
        purpose=metadata.purpose,
        sha256=model().sha256,
        rate_hz=metadata.rate_hz,
        emotions=metadata.emotions,
        thresholds=metadata.levels.threshold,
    )
    return Host(info, metadata, Limits(**limits), model().fingerprint, claim)


def motion(frames: int, *, seed: int = 0, joints: int = 13, speed: float = 0.05) -> np.ndarray:
    """A smooth random walk of rotations: [frame, joint, 4] xyzw, unit."""
    random = np.random.default_rng(seed)
    walk = np.cumsum(random.standard_normal((frames, joints, 4)) * speed, axis=0) + np.array([0.0, 0.0, 0.0, 2.0])
    return walk / np.linalg.norm(walk, axis=-1, keepdims=True)


def as_read(message: object) -> object:
    """What a session said, as its client reads it."""
    return message.to_message() if isinstance(message, LeanEstimate | LeanEstimates) else message
