"""One label out of many flickering guesses, a function of the guesses and their times.

A face analyser says something else in every other picture. Shares are averaged over time; a label is taken on when its
average is high, and given up only when it is low, so that it doesn't flicker at the border. In between, and where no
face is seen for a while, the label is `unknown`: fervor then says how intense the movement is, whatever it means.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from fervor.emotions import UNKNOWN

MEMORY_S = 0.5
"""Time constant of the average, seconds."""

TAKEN_ON = 0.6
"""Averaged share from which on a label is believed; over a half, so that there is one at most."""

GIVEN_UP = 0.4
"""Averaged share below which it is no longer."""


@dataclass
class SteadyLabel:
    """The label of one face."""

    label: str = UNKNOWN
    shares: dict[str, float] = field(default_factory=dict)
    time: float | None = None  # seconds, of the last guess

    def update(self, time: float, guess: Mapping[str, float] | None) -> str:
        """Take in what an analyser says at a time.

        Args:
            time: seconds, rising.
            guess: a probability per emotion; None where it sees no face.

        Returns:
            The label from now on.
        """
        keep = 0.0 if self.time is None else math.exp(-(time - self.time) / MEMORY_S)
        self.time = time
        names = {*self.shares, *(guess or {})}
        self.shares = {
            name: keep * self.shares.get(name, 0.0) + (1.0 - keep) * (guess or {}).get(name, 0.0) for name in names
        }
        best = max(self.shares, key=self.shares.__getitem__, default=UNKNOWN)
        if self.shares.get(best, 0.0) >= TAKEN_ON:
            self.label = best
        elif self.shares.get(self.label, 0.0) < GIVEN_UP:
            self.label = UNKNOWN
        return self.label
