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

MOST_STEPS = 1 << 16
"""Frames, or steps of the model where those are more, that are worked on together; a longer take is so alone."""


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
        sizes = [_size(take, terms.metadata.rate_hz) for take in takes]
        for places in _portions(whole, sizes):
            found = score_whole(
                self._model, [takes[at] for at in places], terms, row_multiple=self._row_multiple, progress=tell
            )
            scored.update(zip(places, found, strict=True))
        for places in _portions(stepwise, sizes):
            with self._lock:
                found = score_stepwise(self._open(), [takes[at] for at in places], terms, tell)
            scored.update(zip(places, found, strict=True))
        return [scored[at] for at in range(len(takes))]

    def _open(self) -> Engine:
        if self._engine is None:
            self._engine = Engine(self._model, capacity=MOST_TOGETHER, row_multiple=self._row_multiple)
        return self._engine


def _size(take: Take, rate_hz: float) -> float:
    """Frames of a take, or the steps that they can bring where those are more; a frame brings a second's at most."""
    seconds = float(take.times[-1]) - float(take.times[0]) if len(take) else 0.0
    return max(len(take), min(seconds, len(take)) * rate_hz)


def _portions(places: Sequence[int], sizes: Sequence[float]) -> Iterator[list[int]]:
    """Places of takes that are worked on together."""
    portion: list[int] = []
    size = 0.0
    for at in places:
        if portion and (len(portion) == MOST_TOGETHER or size + sizes[at] > MOST_STEPS):
            yield portion
            portion, size = [], 0.0
        portion.append(at)
        size += sizes[at]
    if portion:
        yield portion


def _say_nothing(_: int) -> None:
    """Nobody asked for progress."""
