"""Whole sequences through the model: rows of many steps, side by side with others of about their length.

A lane starts from a state of zero, so what it does between two restarts is a sequence of its own: even one long take is
many rows. Rows are sorted by length and run a span of steps a call; those that end drop out, so that no more than a
part of a span is computed for nothing.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.errors import EngineError
from fervor.model import Floats, Model
from fervor.session.lanes import LANES

MOST_ROWS = 40
"""Rows in one call."""

SPAN = 32
"""Steps in one call. Rows times steps is no more than what a model was checked for at its start."""


@dataclass(frozen=True, slots=True)
class Row:
    """What one lane does between two restarts."""

    lane: int
    start: int
    """Its first step."""
    stop: int
    emotion: int
    """Which of the emotion vectors holds."""

    def __len__(self) -> int:
        return self.stop - self.start


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """What the model eats, and the emotions that hold in some of it."""

    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]
    emotions: Floats  # [vector, emotion]


@dataclass(frozen=True, slots=True, eq=False)
class Said:
    """What every lane says in every step; 0 where it says nothing."""

    intensity: Floats  # [lane, step]
    by_emotion: Floats | None  # [lane, step, emotion]; None where it is not wanted

    def cut(self, start: int, stop: int) -> "Said":
        """What was said in some steps."""
        by_emotion = None if self.by_emotion is None else self.by_emotion[:, start:stop]
        return Said(self.intensity[:, start:stop], by_emotion)


def run_rows(
    model: Model,
    steps: Steps,
    rows: Sequence[Row],
    *,
    by_emotion: bool,
    row_multiple: int,
    progress: Callable[[int], None],
) -> Said:
    """Run rows, each from a state of zero.

    Args:
        model: what to run.
        steps: of all rows.
        rows: in any order; a lane has each step once at most.
        by_emotion: whether the intensity under every emotion is wanted too.
        row_multiple: see `fervor.engine.Engine`.
        progress: called with the number of steps done since the last call.

    Raises:
        EngineError: the model failed, or gave an intensity that is not finite.
    """
    intensity = np.zeros((LANES, len(steps.mask)), np.float32)
    said = Said(intensity, np.zeros((*intensity.shape, len(EMOTIONS)), np.float32) if by_emotion else None)
    ordered = sorted(rows, key=len, reverse=True)
    for first in range(0, len(ordered), MOST_ROWS):
        for done in _run_together(model, steps, ordered[first : first + MOST_ROWS], said, row_multiple):
            progress(done)
    return said


def _run_together(model: Model, steps: Steps, rows: Sequence[Row], said: Said, row_multiple: int) -> Iterator[int]:
    """Run rows, the longest first, span by span; yields how many steps were done."""
    count = len(rows)
    rows = [*rows, *[rows[-1]] * (-count % row_multiple)]  # padding, which says the same as the row it repeats
    start, stop, lane, emotion = np.array([(row.start, row.stop, row.lane, row.emotion) for row in rows], np.intp).T
    states: Mapping[str, Floats] = model.zero_states(len(rows))
    for begun in range(0, len(rows[0]), SPAN):
        live = _live(stop - start > begun, row_multiple)
        span = np.arange(begun, min(begun + SPAN, len(rows[0])))
        at = start[:live, None] + span  # [row, step]
        ran = at < stop[:live, None]
        held = np.minimum(at, stop[:live, None] - 1)  # what is run for nothing repeats the last step
        outputs = model.run(
            steps.rotations[held],
            steps.mask[held],
            np.repeat(steps.emotions[emotion[:live], None], len(span), axis=1),
            {name: state[:live] for name, state in states.items()},
        )
        states = outputs.states
        if not np.isfinite(outputs.intensity[ran]).all():
            raise EngineError("the model gave an intensity that is not finite")
        place = (np.broadcast_to(lane[:live, None], at.shape)[ran], at[ran])
        said.intensity[place] = outputs.intensity[ran]
        if said.by_emotion is not None:
            said.by_emotion[place] = outputs.intensity_by_emotion[ran]
        yield int(ran[:count].sum())


def _live(going_on: npt.NDArray[np.bool_], row_multiple: int) -> int:
    """How many rows to run so that all that go on are among them."""
    live = int(np.flatnonzero(going_on)[-1]) + 1
    return min(live + -live % row_multiple, len(going_on))
