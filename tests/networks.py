"""Things that tests of the training side share: networks worth comparing, frames, clips, an honest contract."""

from functools import cache

import numpy as np
import torch

from fervor.emotions import EMOTIONS
from fervor.metadata import LevelRule, ModelMetadata, TrainingData
from fervor.skeletons.rig import JOINTS, PARENTS
from fervor_export.clip import Clip
from fervor_export.graph import build_model
from fervor_export.network import Network, NetworkConfig

torch.set_num_threads(1)  # these networks are small, and the machine is not ours alone

CONFIGS = tuple(
    NetworkConfig(features=features, head=head)
    for features in ("euler", "rot6d+velocity")
    for head in ("additive", "gated")
)


DEFAULT = NetworkConfig()


def network(config: NetworkConfig = DEFAULT, *, seed: int = 0) -> Network:
    """Random weights, large enough for all outputs to move over their range."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        made = Network(config)
        with torch.no_grad():
            for parameter in (*made.lstm1.parameters(), *made.lstm2.parameters()):
                parameter.mul_(3.0)
            for parameter in made.head.parameters():
                if parameter.requires_grad:
                    parameter.normal_(0.0, 0.3)
    return made.eval()


def metadata(config: NetworkConfig = DEFAULT, **changes) -> ModelMetadata:
    """The contract of a network."""
    values = {
        "name": "test",
        "version": "1",
        "purpose": "demo",
        "joints": JOINTS,
        "parents": PARENTS,
        "rate_hz": config.rate_hz,
        "features": config.features,
        "states": config.states,
        "levels": LevelRule(threshold=dict.fromkeys((*EMOTIONS, "unknown"), 0.5)),
        "training": TrainingData(description="none", sha256="", recordings=0, hours=0.0),
    }
    return ModelMetadata(**(values | changes))


@cache
def model_bytes(config: NetworkConfig = DEFAULT) -> bytes:
    """The model file of `network(config)`."""
    return build_model(network(config), metadata(config)).SerializeToString()


def frames(batch: int, time: int, *, seed: int = 0):
    """Rotations, mask and emotion of moving bodies: float32."""
    random = np.random.default_rng(seed)
    rotations = random.standard_normal((batch, 1, len(JOINTS), 4))
    rotations = rotations + 0.1 * random.standard_normal((batch, time, len(JOINTS), 4)).cumsum(1)
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    mask = random.random((batch, time, len(JOINTS))) < 0.9
    emotion = random.dirichlet(np.ones(len(EMOTIONS)), (batch, time))
    emotion[::2] = np.eye(len(EMOTIONS))[random.integers(len(EMOTIONS), size=emotion[::2].shape[:2])]
    emotion[::5] = 0.0
    return rotations.astype(np.float32), mask.astype(np.float32), emotion.astype(np.float32)


def waving_clips(count: int, *, actors: int = 6, seed: int = 0) -> list[Clip]:
    """Clips in which the intensity is how far and fast the arms swing: learned in seconds."""
    random = np.random.default_rng(seed)
    clips = []
    for number in range(count):
        length, intensity = int(random.integers(40, 75)), float(random.random())
        phase = 2 * np.pi * (random.random() + (0.5 + 2 * intensity) * np.arange(length) / 30.0)
        angle = np.zeros((length, len(JOINTS)))
        angle[:, 3:9] = intensity * np.sin(phase)[:, None]
        rotations = np.zeros((length, len(JOINTS), 4), np.float32)
        rotations[..., 0], rotations[..., 3] = np.sin(angle / 2), np.cos(angle / 2)
        clips.append(
            Clip(
                rotations=rotations,
                mask=np.ones((length, len(JOINTS)), np.bool_),
                emotion=EMOTIONS[number % len(EMOTIONS)],
                intensity=intensity,
                actor=f"actor{number % actors}",
                name=f"clip{number}",
                observers=None if number % 2 else 10,
            )
        )
    return clips
