"""Mode `none` of the paper: fillers like "oh" and "hmm" at random times, whatever is shown.

Rules: no estimate is looked at, so times and words depend on the seed alone · the pause from one filler to the next is
drawn evenly from the behaviour's range · fillers that were due while the robot was busy are not made up for.
"""

import random
from dataclasses import dataclass

from fervor_pepper.behaviour import Behaviour
from fervor_pepper.choice import Choice


@dataclass(frozen=True, slots=True)
class Filler:
    """Something to say to nobody in particular."""

    say: str


class FillerTimes:
    """When to say which filler."""

    def __init__(self, behaviour: Behaviour, dice: random.Random) -> None:
        self._range = behaviour.fillers
        self._dice = dice
        self._words = Choice(behaviour.words.fillers, dice)
        self._due: float | None = None

    def wish(self, now: float) -> Filler | None:
        """The filler that is due at `now` (seconds), once; None while none is."""
        if self._due is None:
            self._due = now + self._pause()
        if now < self._due:
            return None
        while self._due <= now:
            self._due += self._pause()
        return Filler(self._words.draw())

    def _pause(self) -> float:
        # Half a tick at least: a range of zero must not hang the loop above.
        return max(self._dice.uniform(self._range.least_s, self._range.most_s), 0.05)
