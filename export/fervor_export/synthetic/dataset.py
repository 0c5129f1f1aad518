"""A whole data set of clips: persons, takes, observers and sensors.

The label of a clip is the share of observers expected to name its intended emotion, given what shows in the clip: that
is the target without the noise of one small panel, which only blurs a network's training. Ask for `votes` to get
panels of about eleven with their sampling noise, as real data have.
"""

import numpy as np

from fervor.emotions import EMOTIONS
from fervor_export.clip import RATE_HZ, Clip
from fervor_export.synthetic import body
from fervor_export.synthetic.channels import INDEX
from fervor_export.synthetic.director import Director
from fervor_export.synthetic.manner import Course, Manner, habit
from fervor_export.synthetic.motion import STARTLING, constant
from fervor_export.synthetic.observers import Panel, named
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.script import Script, Stretch
from fervor_export.synthetic.sensing import sense
from fervor_export.synthetic.tracks import Array, minimum_jerk

PERSONS = 60
"""How many different persons a data set has, if it has that many clips."""

MISFIT = 0.18
"""Share of clips that display another emotion than the intended one: actors fail, labels are wrong."""


def synthesise_dataset(*, clips: int, seed: int, votes: bool = False) -> list[Clip]:
    """Labelled clips of expressive motion; the same seed gives the same clips, and more clips begin with them.

    Args:
        clips: how many.
        seed: everything follows from it.
        votes: label with the share in a drawn panel (`Clip.observers` says its size) instead of the expected share.
    """
    cast = [
        Person.draw(np.random.default_rng((seed, 0, index)), f"synthetic-{seed}-{index:02d}")
        for index in range(PERSONS)
    ]
    return [_clip(np.random.default_rng((seed, 1, index)), cast, index, votes=votes) for index in range(clips)]


def _clip(rng: np.random.Generator, cast: list[Person], index: int, *, votes: bool) -> Clip:
    """One clip, from its own stream of chance."""
    person = cast[int(rng.integers(len(cast)))]
    intended = EMOTIONS[index % len(EMOTIONS)]
    displayed, level = _display(rng, intended)
    seconds = float(np.clip(np.exp(rng.normal(1.45, 0.42)), 2.0, 12.0))
    events = _events(rng, displayed, seconds)
    scene = Scene.draw(rng)
    manner = Manner.draw(rng, displayed, _course(rng, displayed, level, seconds, events), person)
    script = Director(rng, person, scene, manner, seconds=seconds, events=events).write()
    times = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    share = named(intended, displayed, visible(script, times))
    rotations, mask = sense(rng, body.pose(script, times))
    panel = Panel.draw(rng)
    return Clip(
        rotations=rotations.astype(np.float32),
        mask=mask,
        emotion=intended,
        intensity=panel.vote(rng, share) if votes else share,
        actor=person.name,
        name=f"{person.name}-{index:05d}-{intended}",
        observers=panel.size if votes else None,
    )


def visible(script: Script, times: Array) -> float:
    """How much of its emotion a take shows (see `Manner.visible`), judged by what really happens in it."""
    window = float(times[-1])
    gesturing, own = (_within(stretches, window) for stretches in (script.gestures, script.emblems))
    laughing = _within([(bout.start, bout.start + bout.duration) for bout in script.laughs], window)
    began = any(-0.2 < event < window - 0.3 for event in script.events)
    seen = script.scene.seen()
    seen["gesture"] *= 0.25 + 0.75 * min(1.0, gesturing / (0.4 * window))
    strong = float(script.manner.strong[INDEX["start"]])
    realised = {
        "emblem": min(1.0, own / (0.4 * window)),
        "laugh": laughing / window,
        "start": strong * float(script.manner.course(times).max()) * began,
    }
    return script.manner.visible(times, seen, realised, habit(script.person, script.scene))


def _within(stretches: list[Stretch], window: float) -> float:
    """Seconds of stretches that fall between 0 and `window`."""
    return sum(max(0.0, min(end, window) - max(begin, 0.0)) for begin, end in stretches)


def _display(rng: np.random.Generator, intended: str) -> tuple[str, float]:
    """The emotion that the body displays, and its intensity."""
    level = float(rng.uniform(0.0, 1.0))
    others = [emotion for emotion in EMOTIONS if emotion not in (intended, "neutral")]
    if intended == "neutral":
        return others[int(rng.integers(len(others)))], level**2 if rng.random() < 0.75 else 0.0
    if rng.random() < MISFIT:
        return others[int(rng.integers(len(others)))], level
    return intended, level


def _events(rng: np.random.Generator, emotion: str, seconds: float) -> tuple[float, ...]:
    """When the person is startled: mostly inside the clip, now and then before it."""
    if rng.random() >= STARTLING.get(emotion, 0.0):
        return ()
    return (float(rng.uniform(-0.8, 0.6 * seconds)),)


def _course(rng: np.random.Generator, emotion: str, level: float, seconds: float, events: tuple[float, ...]) -> Course:
    """Intensity over time: mostly steady, sometimes growing or fading; surprise comes at once and wears off."""
    if emotion == "surprise" and events:
        onset, fade, rest = events[0], float(rng.uniform(1.5, 5.0)), float(rng.uniform(0.3, 0.7))
        before = 0.1 * level

        def sudden(times: Array) -> Array:
            rise = minimum_jerk((times - onset) / 0.3)
            decay = rest + (1.0 - rest) * np.exp(-np.maximum(times - onset - 0.8, 0.0) / fade)
            return before + (level * decay - before) * rise

        return sudden
    if rng.random() < 0.65:
        return constant(level)
    other = float(np.clip(level + rng.normal(0.0, 0.3), 0.0, 1.0))
    begin, length = float(rng.uniform(-0.2, 0.7)) * seconds, float(rng.uniform(0.2, 1.0)) * seconds
    return lambda times: level + (other - level) * minimum_jerk((times - begin) / length)
