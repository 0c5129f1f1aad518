"""How one person shows one emotion in one take: channel values at any time, and how much there is to be seen.

Intensity runs over time as a function given from outside. Every channel follows it with a deviation of its own, because
there are many ways to be intense: one take is all bounce and no size, another the other way round.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fervor_export.synthetic.channels import CHANNELS, INDEX, NEUTRAL, SEEN_IN, blend, bounds, distance
from fervor_export.synthetic.person import USUAL_STEP_HZ, Person
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.tracks import Array

Course = Callable[[Array], Array]
"""Intensity [frame] in [0, 1] at times [frame] in seconds."""


@dataclass(frozen=True, slots=True)
class Manner:
    """An emotion as a person shows it in one take."""

    emotion: str
    course: Course
    weak: Array  # [channel] in this take, at intensity 0
    strong: Array  # [channel] at intensity 1
    shift: Array  # [channel] added to the intensity of each channel

    @classmethod
    def draw(
        cls, rng: np.random.Generator, emotion: str, course: Course, person: Person, *, variety: float = 0.17
    ) -> "Manner":
        """A take of `emotion`; `variety` is the standard deviation of single channels about the intensity."""
        weak, strong, spread = bounds(emotion)
        strong = strong + person.idiom * spread * np.where(weak == strong, 0.0, 1.0)
        return cls(emotion, course, weak, strong, rng.normal(0.0, variety, len(CHANNELS)))

    def over(self, times: Array) -> Array:
        """Channel values [frame, channel] at `times` [frame]."""
        intensity = self.course(times)[:, None]
        fade = np.minimum(1.0, 4.0 * intensity)  # nobody is intense in a channel while showing nothing
        return blend(self.weak, self.strong, intensity + self.shift * fade)

    def at(self, time: float) -> dict[str, float]:
        """Channel values by name at one time."""
        values = self.over(np.array([time]))[0]
        return {channel.name: float(value) for channel, value in zip(CHANNELS, values, strict=True)}

    def visible(self, times: Array, seen: dict[str, float], realised: dict[str, float], habit: Array) -> float:
        """How much of the emotion shows: 0 as in a weak, 1 as in a strong take of an average person.

        Every channel counts by how many just noticeable differences it moves between weak and strong. Viewers go by
        the stronger moments more than by the mean (peak rule, Kahneman 2000).

        Args:
            times: frames of the take.
            seen: how well each kind of channel (`Channel.seen_in`) can be seen in it, 0 to 1.
            realised: channels of single events and what really came of them in the take; that and what was meant
                count alike.
            habit: [channel] how the person differs from others whatever they feel, in just noticeable differences.
                Viewers don't know the person, and take half of it for expression.
        """
        weak, strong, _ = bounds(self.emotion)
        whole = distance(weak, strong)  # [channel]
        values = self.over(times).copy()  # [frame, channel]
        for name, value in realised.items():
            values[:, INDEX[name]] = 0.5 * values[:, INDEX[name]] + 0.5 * value
        shown = (distance(weak, values) + 0.5 * habit) * np.sign(whole)
        weight = np.array([seen[kind] for kind in SEEN_IN])
        per_frame = (shown * weight).sum(axis=1) / max(float((np.abs(whole) * weight).sum()), 1e-9)
        return float(0.55 * per_frame.mean() + 0.45 * np.percentile(per_frame, 85))


def habit(person: Person, scene: Scene) -> Array:
    """How a person moves whatever they feel, against an average one, in just noticeable differences [channel]."""
    usual = NEUTRAL.copy()
    own = {
        "slump": person.slump, "lean": person.lean, "head": person.head, "tempo": person.tempo * scene.vigour,
        "reach": person.size * scene.vigour**0.5, "rate": person.rate * scene.vigour, "sway": person.unrest,
        "nod": person.nod, "swing": person.size**0.7 * scene.drive, "stride": scene.vigour**0.2 * scene.pace,
        "cadence": person.step_hz / USUAL_STEP_HZ * scene.vigour**0.4 * scene.pace**0.5,
    }  # fmt: skip
    for name, value in own.items():
        usual[INDEX[name]] = usual[INDEX[name]] * value if CHANNELS[INDEX[name]].ratio else value
    return distance(NEUTRAL, usual)
