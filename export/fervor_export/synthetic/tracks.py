"""Movement as a function of time, so that one plan can be seen at any frame rate.

A `Track` is a sum of minimum-jerk submovements: every stroke has the bell-shaped speed of human reaching (Flash & Hogan
1985), and a stroke that begins before the last one has ended adds to it (Flash & Henis 1991). A `Wobble` is what
never rests: sway, breathing, tremor, as band-limited noise. Nothing here draws chance while it is being looked at.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def minimum_jerk(progress: Array) -> Array:
    """Share of a stroke done, [...] from 0 to 1, at a share of its duration (clipped to 0..1)."""
    p = np.clip(progress, 0.0, 1.0)
    return p * p * p * (10.0 + p * (6.0 * p - 15.0))


def bump(progress: Array) -> Array:
    """A smooth rise and fall [...] from 0 over 1 (at half time) back to 0."""
    p = np.clip(progress, 0.0, 1.0)
    return 16.0 * (p * (1.0 - p)) ** 2


@dataclass(slots=True)
class Track:
    """A value [dim] that moves in strokes; strokes are appended while a motion is planned."""

    now: Array  # [dim] where all strokes so far lead
    begin: Array = field(init=False)  # [dim] before the first stroke
    starts: list[float] = field(default_factory=list)
    durations: list[float] = field(default_factory=list)
    steps: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.begin = self.now

    def move(self, start: float, duration: float, target: Array) -> None:
        """Be at `target` [dim] at `start + duration` (seconds)."""
        self.push(start, duration, target - self.now)

    def push(self, start: float, duration: float, step: Array) -> None:
        """Add `step` [dim] to the value within `duration` seconds from `start`."""
        self.starts.append(start)
        self.durations.append(max(duration, 0.02))
        self.steps.append(step)
        self.now = self.now + step

    def swell(self, start: float, duration: float, step: Array) -> None:
        """Go out by `step` [dim] and come back within `duration` seconds."""
        self.push(start, 0.5 * duration, step)
        self.push(start + 0.5 * duration, 0.5 * duration, -step)

    def at(self, times: Array) -> Array:
        """Values [frame, dim] at `times` [frame]."""
        if not self.steps:
            return np.repeat(self.begin[None], len(times), axis=0)
        progress = (times[:, None] - np.array(self.starts)) / np.array(self.durations)
        value: Array = self.begin + minimum_jerk(progress) @ np.array(self.steps)
        return value


@dataclass(frozen=True, slots=True)
class Wobble:
    """Band-limited noise of standard deviation 1 in every dimension: a sum of sines of drawn frequency and phase."""

    frequencies: Array  # [term] Hz
    sine: Array  # [term, dim]
    cosine: Array  # [term, dim]

    @classmethod
    def draw(cls, rng: np.random.Generator, *, low_hz: float, high_hz: float, dim: int, terms: int = 7) -> "Wobble":
        """Noise between two frequencies with a 1/f spectrum, as standing sway has (Winter 1995)."""
        frequencies = np.exp(rng.uniform(np.log(low_hz), np.log(high_hz), terms))
        size = rng.rayleigh(size=(terms, dim)) / np.sqrt(terms)  # log-spaced terms of equal power: 1/f
        phase = rng.uniform(0.0, 2.0 * np.pi, (terms, dim))
        return cls(frequencies, size * np.sin(phase), size * np.cos(phase))

    def at(self, times: Array) -> Array:
        """Values [frame, dim] at `times` [frame]."""
        angle = 2.0 * np.pi * times[:, None] * self.frequencies
        value: Array = np.sin(angle) @ self.cosine + np.cos(angle) @ self.sine
        return value
