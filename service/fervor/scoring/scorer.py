"""Scores takes with one model, each the fastest way that gives the stream's estimates."""

import threading
from collections.abc import Callable, Iterator, Sequence

from fervor.engine.engine import Engine
from fervor.model import Model
from fervor.scoring.scored import Scored
from fervor.scoring.stepwise import score_stepwise
from fervor.scoring.take import Take
from fervor.scoring.whole import fits, score_whole
from fervor.session.body import Terms

MOST_TOGETHER = 256
"""Takes worked on together."""

MOST_FRAMES = 1 << 16
"""Frames worked on together, so that memory is bounded; a longer take is worked on alone."""


class Scorer:
    """Scores recordings with one model. Thread-safe; blocks its caller."""

    def __init__(self, model: Model, *, row_multiple: int = 1) -> None:
        """Prepare.

        Args:
            model: what to run.
            row_multiple: see `fervor.engine.Engine`.
        """
        self._model = model
        self._row_multiple = row_multiple
        self._engine: Engine | None = None
        self._lock = threading.Lock()

    def score(
        self, takes: Sequence[Take], terms: Terms, *, progress: Callable[[int], None] | None = None
    ) -> list[Scored]:
        """One estimate a frame of every take, in order.

        Args:
            takes: what to score.
            terms: as a live session would agree on them.
            progress: called with the number of frames done since the last call.

        Raises:
            InputError: an emotion that is not known.
            EngineError: the model failed.
        """
        tell = progress or _say_nothing
        whole = [at for at, take in enumerate(takes) if fits(take, terms)]
        stepwise = sorted(set(range(len(takes))) - set(whole))
        scored: dict[int, Scored] = {}
        for places in _portions(whole, takes):
            found = score_whole(
                self._model, [takes[at] for at in places], terms, row_multiple=self._row_multiple, progress=tell
            )
            scored.update(zip(places, found, strict=True))
        for places in _portions(stepwise, takes):
            with self._lock:
                found = score_stepwise(self._open(), [takes[at] for at in places], terms, tell)
            scored.update(zip(places, found, strict=True))
        return [scored[at] for at in range(len(takes))]

    def _open(self) -> Engine:
        if self._engine is None:
            self._engine = Engine(self._model, capacity=MOST_TOGETHER, row_multiple=self._row_multiple)
        return self._engine


def _portions(places: Sequence[int], takes: Sequence[Take]) -> Iterator[list[int]]:
    """Places of takes that are worked on together."""
    portion: list[int] = []
    frames = 0
    for at in places:
        if portion and (len(portion) == MOST_TOGETHER or frames + len(takes[at]) > MOST_FRAMES):
            yield portion
            portion, frames = [], 0
        portion.append(at)
        frames += len(takes[at])
    if portion:
        yield portion


def _say_nothing(_: int) -> None:
    """Nobody asked for progress."""
