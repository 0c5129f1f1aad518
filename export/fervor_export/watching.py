"""A training as a person watches it: a bar, a line an epoch, and the time that is left."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from fervor_export.pace import Pace, said
from fervor_export.trainer import Epoch


class Watcher:
    """Shows trainings, one after the other."""

    def __init__(self, progress: Progress, pace: Pace) -> None:
        self.progress, self.pace = progress, pace
        self.started = time.monotonic()
        self.what = "training"
        self.task = progress.add_task(self.what, total=pace.total)

    def begin(self, what: str, training: int) -> None:
        """What begins, and how many trainings are done."""
        if training != self.pace.training:
            self.pace.begin(training)
        self.what = what
        self._show()

    def epoch(self, done: Epoch) -> None:
        """An epoch is done."""
        self.pace.epoch(done.number)
        self._show()
        scores = done.validation
        judged = "" if scores is None else (
            f"  validation MAE {scores.mae:.4f}  r {scores.r:.3f}  within {scores.r_within:.3f}  CCC {scores.ccc:.3f}"
        )  # fmt: skip
        line = f"{self.what}, epoch {done.number:3}  train MAE {done.train_mae:.4f}{judged}  {done.seconds:.0f} s"
        self.progress.console.print(f"{line}{self._left()}", highlight=False, soft_wrap=True)

    def _left(self) -> str:
        left = self.pace.left_s(time.monotonic() - self.started)
        return "" if not left else f", {said(left)} left"

    def _show(self) -> None:
        self.progress.update(self.task, description=f"{self.what}{self._left()}", completed=self.pace.done)


@contextmanager
def watching(trainings: int, epochs: int) -> Iterator[Watcher]:
    """A `Watcher` of so many trainings of so many epochs, on standard error."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Watcher(progress, Pace(trainings, epochs))
