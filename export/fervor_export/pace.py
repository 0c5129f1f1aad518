"""How long trainings still take, judged by the epochs done since they began.

Epochs that need no doing, because an earlier run did them or because a training ended early, count as done but not as
work: they say nothing of the speed.
"""

from dataclasses import dataclass


@dataclass(slots=True)
class Pace:
    """Trainings of so many epochs each, one after the other; folds of one data set take about as long as each other."""

    trainings: int
    epochs: int
    """Of each, at most."""
    training: int = 0
    """Which is under way, from 0."""
    reached: int = 0
    """Epochs of it that are done."""
    worked: int = 0
    """Epochs done since the beginning."""

    def begin(self, training: int) -> None:
        """Another training begins."""
        self.training, self.reached = training, 0

    def epoch(self, number: int) -> None:
        """An epoch of the training under way is done."""
        self.reached, self.worked = number, self.worked + 1

    @property
    def done(self) -> int:
        """Epochs that lie behind, skipped ones included."""
        return self.training * self.epochs + self.reached

    @property
    def total(self) -> int:
        """Epochs in all."""
        return self.trainings * self.epochs

    def left_s(self, elapsed_s: float) -> float | None:
        """Seconds that the rest takes at most, after `elapsed_s` of work; None before the first epoch."""
        return (self.total - self.done) * elapsed_s / self.worked if self.worked else None


def said(seconds: float) -> str:
    """A duration as people say it: "about 3 h 20 min"."""
    if seconds < 90:
        return f"about {max(round(seconds / 5) * 5, 5)} s"
    minutes = round(seconds / 60)
    if minutes < 60:
        return f"about {minutes} min"
    hours, rest = divmod(round(minutes / 5) * 5, 60)
    return f"about {hours} h {rest} min" if rest else f"about {hours} h"
