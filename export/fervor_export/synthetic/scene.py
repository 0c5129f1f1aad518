"""What the body does besides feeling: it sits, stands or walks, and talks, acts, works, dances or listens.

The scene moves the body as much as the emotion does, and is drawn without looking at the emotion: a model that only
measures movement learns nothing from it. Sitting follows the EBMDB's stool (knees near 90°, pelvis tipped back).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

K = TypeVar("K", bound=str)

Posture = Literal["sit", "stand", "walk"]
Activity = Literal["talk", "act", "task", "dance", "listen"]

POSTURES: dict[Posture, float] = {"stand": 0.40, "sit": 0.38, "walk": 0.22}
ACTIVITIES: dict[Posture, dict[Activity, float]] = {
    "stand": {"talk": 0.38, "act": 0.30, "task": 0.12, "dance": 0.08, "listen": 0.12},
    "sit": {"talk": 0.50, "act": 0.28, "task": 0.08, "dance": 0.0, "listen": 0.14},
    "walk": {"talk": 0.25, "act": 0.15, "task": 0.0, "dance": 0.0, "listen": 0.60},
}
"""How often each happens."""

RATE: dict[Activity, float] = {"talk": 1.0, "act": 1.25, "task": 1.2, "dance": 1.6, "listen": 0.15}
"""x, how many gestures an activity has."""

EMBLEM: dict[Activity, float] = {"talk": 0.75, "act": 1.0, "task": 0.25, "dance": 0.35, "listen": 0.8}
"""x, how far an activity leaves room for the emotion's own gestures."""

SEEN: dict[Activity, float] = {"talk": 1.0, "act": 1.0, "task": 0.9, "dance": 0.8, "listen": 0.25}
"""0..1, how much a viewer can read from its gestures."""

LOOK: dict[Posture, tuple[float, float]] = {"stand": (0.0, 3.0), "sit": (0.0, 3.0), "walk": (8.0, 7.0)}
"""Degrees, mean and standard deviation: how far down people look while they do nothing else."""


@dataclass(frozen=True, slots=True)
class Scene:
    """The setting of one take; angles in degrees."""

    posture: Posture
    activity: Activity
    vigour: float  # x, how lively the task itself is, whatever is felt
    pelvis: float  # pelvis tipped forward (+) or back (-)
    thigh: tuple[float, float]  # left, right: thigh raised forward
    spread: tuple[float, float]  # left, right: thigh to the side
    knee: tuple[float, float]  # left, right
    rest: float  # drawn in 0..1: which resting pose
    gaze: float  # head yaw towards the partner
    look: float  # head pitch towards what is looked at: walkers mostly look at the ground ahead
    pace: float  # x, how fast and far a walker steps
    drive: float  # x, how far a walker's arms swing
    feet: float  # x, how restless standing feet are

    @classmethod
    def draw(
        cls, rng: np.random.Generator, posture: Posture | None = None, activity: Activity | None = None
    ) -> "Scene":
        """A scene; posture and activity can be given."""
        posture = posture or choose(rng, POSTURES)
        activity = activity or choose(rng, ACTIVITIES[posture])
        if posture == "sit":
            knee, thigh = rng.normal(90.0, 9.0), rng.normal(86.0, 7.0)
            legs = thigh + rng.normal(0.0, 3.0, 2), rng.uniform(3.0, 18.0, 2), knee + rng.normal(0.0, 5.0, 2)
            pelvis = -float(rng.uniform(4.0, 46.0))
        else:
            legs = rng.normal(3.0, 3.0, 2), rng.normal(4.0, 2.5, 2), np.abs(rng.normal(5.0, 4.0, 2))
            pelvis = float(rng.normal(0.0, 5.0))
        thigh_pair, spread_pair, knee_pair = ((float(pair[0]), float(pair[1])) for pair in legs)
        pace, drive, feet = np.exp(rng.normal(0.0, (0.18, 0.35, 0.6))).tolist()
        return cls(
            posture, activity, float(np.exp(rng.normal(0.0, 0.25))), pelvis, thigh_pair, spread_pair, knee_pair,
            float(rng.random()), float(rng.normal(0.0, 8.0)), float(rng.normal(*LOOK[posture])),
            pace, pace * drive, feet,
        )  # fmt: skip

    def seen(self) -> dict[str, float]:
        """How well each kind of channel can be seen here, 0 to 1."""
        return {
            "posture": 1.0,
            "rhythm": 1.0,
            "gesture": SEEN[self.activity],
            "gait": 1.0 if self.posture == "walk" else 0.0,
        }


def choose(rng: np.random.Generator, weights: Mapping[K, float]) -> K:
    """One key, as often as its weight says."""
    keys = list(weights)
    share = np.array(list(weights.values()), float)
    return keys[int(rng.choice(len(keys), p=share / share.sum()))]
