"""Runs tickets: adapts their poses, puts them on the grid, steps the model for all bodies at once, keeps the states.

A batch either changes all of its bodies' slots or, if the model fails, none of them. The result of a ticket does not
depend on what else is in its batch: the model was checked for that at start-up, all else is elementwise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.history import NO_HISTORY
from fervor.engine.memory import BatchMemory, States
from fervor.engine.posing import Poses, adapt_all, between, hold, reject_jumps
from fervor.engine.slots import Slots
from fervor.errors import EngineError
from fervor.model import Floats, Model
from fervor.session.checkpoint import Memory
from fervor.session.events import Outcome, Step, Ticket
from fervor.session.lanes import LANES, lane_plan

MOST_ROWS = 256
"""Rows in one call of the model; larger batches are cut, for cache and latency."""


class Engine:
    """The state of all bodies of a process, and the model that moves it."""

    def __init__(self, model: Model, *, capacity: int, row_multiple: int = 1) -> None:
        """Allocate.

        Args:
            model: what to run.
            capacity: bodies at most.
            row_multiple: batches are padded to a multiple of this (1 unless the model's rows depend on it).
        """
        self.model = model
        self.slots = Slots(capacity, model.metadata)
        self._row_multiple = row_multiple
        self._plan = lane_plan(model.metadata.rate_hz)

    def claim(self) -> int:
        """A free slot; raises Overloaded where none is left."""
        return self.slots.claim()

    def release(self, slot: int) -> None:
        """Give a slot back; no ticket of it may be under way."""
        self.slots.release(slot)

    def restore(self, slot: int, memory: Memory) -> None:
        """Put what a checkpoint remembers into a slot that was just claimed; raises CheckpointMismatch."""
        self.slots.restore(slot, memory)

    def run(self, tickets: Sequence[Ticket]) -> list[Outcome | EngineError]:
        """The outcome of each ticket, at most one a slot. A ticket that makes the model fail fails alone."""
        try:
            return list(self._run(tickets))
        except EngineError as error:
            if len(tickets) == 1:
                return [error]
            return [outcome for ticket in tickets for outcome in self.run([ticket])]

    def _run(self, tickets: Sequence[Ticket]) -> Iterator[Outcome]:
        slots = self.slots
        rows = np.array([ticket.slot for ticket in tickets], np.intp)  # [ticket] slot
        fresh = np.array([ticket.fresh for ticket in tickets], np.bool_)  # [ticket]
        if fresh.any():
            slots.clear(rows[fresh])
        old = Poses(slots.pose[rows], slots.observed[rows])
        came, hinges = adapt_all(tickets, slots.hinges, rows)
        came, jumps, rejected = reject_jumps(came, old, slots.jumps[rows], _noisy(tickets))
        new = hold(came, old)
        turns = max(len(ticket.steps) for ticket in tickets)
        memory = BatchMemory(slots, rows, copied=turns > 1)
        for turn in range(turns):
            self._turn(tickets, turn, old, new, memory)
        memory.store()
        posed = np.array([ticket.pose is not None for ticket in tickets], np.bool_)  # [ticket]
        slots.move(rows, posed, new=new, jumps=jumps, hinges=hinges)
        return _outcomes(tickets, slots, rows, memory, np.where(posed, np.count_nonzero(rejected, axis=1), 0))

    def _turn(self, tickets: Sequence[Ticket], number: int, old: Poses, new: Poses, memory: BatchMemory) -> None:
        """One grid step of every ticket that has a step `number`."""
        live = [row for row, ticket in enumerate(tickets) if len(ticket.steps) > number]
        steps = [tickets[row].steps[number] for row in live]
        index = np.array(live, np.intp)
        if len(live) < len(tickets):
            old, new = old.rows(index), new.rows(index)
        rotations, mask = between(
            old,
            new,
            np.array([step.fraction for step in steps]),
            np.array([step.held for step in steps]),
        )
        labels = b"".join([step.label.vector.tobytes() for step in steps])  # sooner done than np.stack
        emotion = np.frombuffer(labels, np.float32).reshape(len(steps), len(EMOTIONS))  # [step, emotion]
        taken = _Turn(index, steps, rotations, mask, emotion)
        self._run_lanes(taken, memory)
        self._run_windows(taken, memory)

    def _run_lanes(self, turn: "_Turn", memory: BatchMemory) -> None:
        """The steps of bodies with recurrent states: a row of the model for every lane that runs."""
        place = np.array([step.lanes for step in turn.steps], np.intp)
        runs = self._plan.runs[place]  # [step, lane]
        step, lane = np.nonzero(runs)  # [row]
        if not len(step):
            return
        tickets = turn.index[step]
        states = memory.lanes(tickets, lane)
        restart = np.flatnonzero(self._plan.restart[place][runs])
        if len(restart):
            for state in states.values():
                state[restart] = 0.0
        outputs = self._call(turn.rotations[step], turn.mask[step], turn.emotion[step], states)
        intensity, by_emotion, states = outputs
        memory.move(tickets, lane, states)
        stateful = runs.any(axis=1)
        rows, weight = turn.index[stateful], self._plan.weight[place]  # weight: [step, lane]
        memory.intensity[rows] = _blend(intensity[:, None], runs, weight)[stateful, 0]
        memory.by_emotion[rows] = _blend(by_emotion, runs, weight)[stateful]

    def _run_windows(self, turn: "_Turn", memory: BatchMemory) -> None:
        """The steps of bodies with a window, those of one length together."""
        by_length: dict[int, list[int]] = {}
        for number, step in enumerate(turn.steps):
            if step.window:
                ticket = int(turn.index[number])
                history = memory.histories.get(ticket, NO_HISTORY)
                memory.histories[ticket] = history.then(turn.rotations[number], turn.mask[number], step.window)
                by_length.setdefault(len(memory.histories[ticket]), []).append(number)
        for length, numbers in by_length.items():
            rows = turn.index[numbers]
            poses = [memory.histories[ticket] for ticket in rows.tolist()]
            outputs = self.model.run(
                np.stack([pose.rotations for pose in poses]),
                np.stack([pose.mask for pose in poses]),
                np.repeat(turn.emotion[numbers][:, None], length, axis=1),
                self.model.zero_states(len(numbers)),
            )
            memory.intensity[rows] = _finite(outputs.intensity[:, -1])
            memory.by_emotion[rows] = outputs.intensity_by_emotion[:, -1]

    def _call(
        self,
        rotations: Floats,  # [row, joint, 4]
        mask: Floats,  # [row, joint]
        emotion: Floats,  # [row, emotion]
        states: States,
    ) -> tuple[Floats, Floats, States]:
        """One step of the model, cut into calls: intensity [row], by emotion [row, 11], next states."""
        parts = [
            self._call_once(
                rotations[cut], mask[cut], emotion[cut], {name: state[cut] for name, state in states.items()}
            )
            for cut in (slice(first, first + MOST_ROWS) for first in range(0, len(rotations), MOST_ROWS))
        ]
        if len(parts) == 1:
            return parts[0]
        return (
            np.concatenate([intensity for intensity, _, _ in parts]),
            np.concatenate([by_emotion for _, by_emotion, _ in parts]),
            {name: np.concatenate([after[name] for _, _, after in parts]) for name in states},
        )

    def _call_once(
        self, rotations: Floats, mask: Floats, emotion: Floats, states: States
    ) -> tuple[Floats, Floats, States]:
        """As `_call`, of no more rows than the model is given at once."""
        count = len(rotations)
        spare = -count % self._row_multiple
        outputs = self.model.run(
            _pad(rotations, spare)[:, None],
            _pad(mask, spare)[:, None],
            _pad(emotion, spare)[:, None],
            {name: _pad(state, spare) for name, state in states.items()},
        )
        after = {name: state[:count] for name, state in outputs.states.items()}
        return _finite(outputs.intensity[:count, 0]), outputs.intensity_by_emotion[:count, 0], after


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """One grid step of some of a batch's tickets."""

    index: npt.NDArray[np.intp]  # [step] its ticket
    steps: Sequence[Step]
    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]
    emotion: Floats  # [step, emotion]


def _blend(values: Floats, runs: npt.NDArray[np.bool_], weight: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Values [row, k] of the lanes that run [step, lane], weighted [step, lane] into one a step: [step, k]."""
    spread = np.zeros((*runs.shape, values.shape[1]), np.float32)
    spread[runs] = values
    blended = weight[:, 0, None] * spread[:, 0]
    for lane in range(1, LANES):
        blended += weight[:, lane, None] * spread[:, lane]
    return blended


def _noisy(tickets: Sequence[Ticket]) -> npt.NDArray[np.bool_]:
    """Whose poses can flip: [ticket]."""
    return np.array([ticket.source.skeleton.noisy for ticket in tickets], np.bool_)


def _outcomes(
    tickets: Sequence[Ticket],
    slots: Slots,
    rows: npt.NDArray[np.intp],
    memory: BatchMemory,
    jumped: npt.NDArray[np.int64],
) -> Iterator[Outcome]:
    """What became of each ticket, from arrays by ticket."""
    columns = zip(
        tickets, rows.tolist(), memory.intensity.tolist(), slots.seen[rows].tolist(), jumped.tolist(), strict=True
    )
    for at, (ticket, slot, intensity, seen, jumps) in enumerate(columns):
        known = not isnan(intensity)  # nan: no step yet
        recalled = None if ticket.checkpoint is None else slots.recall(slot)
        yield Outcome(intensity if known else None, memory.by_emotion[at], seen, jumps, recalled)


def _finite(intensity: Floats) -> Floats:
    if not np.isfinite(intensity).all():
        raise EngineError("the model gave an intensity that is not finite; the body starts anew")
    return intensity


def _pad(rows: Floats, spare: int) -> Floats:
    return np.concatenate([rows, np.repeat(rows[:1], spare, axis=0)]) if spare else rows
