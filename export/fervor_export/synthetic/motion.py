"""One take of one person, at any frame rate."""

import numpy as np

from fervor.emotions import EMOTIONS, emotion_index
from fervor_export.synthetic import body
from fervor_export.synthetic.director import Director
from fervor_export.synthetic.manner import Course, Manner
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.tracks import Array

STARTLING = {"surprise": 1.0, "fear": 0.7, "disgust": 0.5, "relief": 0.9}
"""Emotion → how often its takes contain the moment it begins."""


def constant(intensity: float) -> Course:
    """The same intensity at all times."""
    return lambda times: np.full(len(times), intensity)


def synthesise_motion(
    *,
    emotion: str,
    intensity: float | Course,
    seconds: float,
    seed: int,
    rate_hz: float = 30.0,
    person: Person | None = None,
    scene: Scene | None = None,
    events: tuple[float, ...] = (),
) -> tuple[Array, Array]:
    """Expressive motion of one body.

    The same arguments at another rate show the same motion.

    Args:
        emotion: one of `fervor.emotions.EMOTIONS` or a synonym.
        intensity: a number in [0, 1], or a function from times [frame] to intensities [frame].
        seconds: length of the take.
        seed: everything that is drawn follows from it.
        rate_hz: frames a second.
        person: who moves; drawn if absent.
        scene: what else the body does; drawn if absent.
        events: seconds at which something startles the person.

    Returns:
        Times [frame] in seconds and local rotations [frame, 13, 4] xyzw on the rig C13.
    """
    rng = np.random.default_rng(seed)
    person = person or Person.draw(rng, f"person-{seed}")
    scene = scene or Scene.draw(rng)
    course = intensity if callable(intensity) else constant(float(intensity))
    manner = Manner.draw(rng, EMOTIONS[emotion_index(emotion)], course, person)
    script = Director(rng, person, scene, manner, seconds=seconds, events=events).write()
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    return times, body.pose(script, times)
