"""Runs tickets: adapts their poses, puts them on the grid, steps the model for all bodies at once, keeps the states.

A batch either changes all of its bodies' slots or, if the model fails, none of them. The result of a ticket does not
depend on what else is in its batch: the model was checked for that at start-up, all else is elementwise.
"""

from collections.abc import Sequence
from math import isnan
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.history import NO_HISTORY
from fervor.engine.memory import BatchMemory, States
from fervor.engine.posing import Poses, adapt_all, arrived, between, hold, reject_jumps
from fervor.engine.slots import Slots
from fervor.errors import EngineError
from fervor.model import Floats, Model, Outputs
from fervor.session.checkpoint import Memory
from fervor.session.events import Outcome, Step, Ticket
from fervor.session.lanes import LANES, NO_LANES, lane_plan

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
            return [*self._run(tickets)]
        except EngineError as error:
            if len(tickets) == 1:
                return [error]
            return [outcome for ticket in tickets for outcome in self.run([ticket])]

    def _run(self, tickets: Sequence[Ticket]) -> list[Outcome]:
        rows = np.array([ticket.slot for ticket in tickets], np.intp)  # [ticket] slot
        fresh = [ticket.slot for ticket in tickets if ticket.fresh]
        if fresh:
            self.slots.clear(fresh)
        memory = BatchMemory(self.slots, rows)
        records = memory.records
        old = Poses(records["pose"], records["observed"])
        came, hinges = adapt_all(tickets, records["hinges"])
        came, jumps, jumped = _believed(tickets, came, old, records["jumps"])
        new = hold(came, old)
        try:
            for turn in range(max([len(ticket.steps) for ticket in tickets])):
                self._turn(tickets, turn, old, new, memory)
        except BaseException:
            memory.undo()
            raise
        memory.keep(_posed(tickets), new, jumps=jumps, hinges=hinges)
        memory.store()
        return _outcomes(tickets, self.slots, memory, jumped)

    def _turn(self, tickets: Sequence[Ticket], number: int, old: Poses, new: Poses, memory: BatchMemory) -> None:
        """One grid step of every ticket that has a step `number`."""
        steps = [ticket.steps[number] for ticket in tickets if len(ticket.steps) > number]
        if len(steps) == len(tickets):
            index = np.arange(len(tickets))
        else:
            index = np.array([row for row, ticket in enumerate(tickets) if len(ticket.steps) > number], np.intp)
            old, new = old.rows(index), new.rows(index)
        fractions, held = [step.fraction for step in steps], [step.held for step in steps]
        if True not in held and min(fractions) >= 1.0:  # as of sensors that keep the grid's time
            rotations, mask = arrived(new)
        else:
            rotations, mask = between(old, new, np.array(fractions), np.array(held))
        labels = b"".join([step.label.vector.tobytes() for step in steps])  # sooner done than np.stack
        emotion = np.frombuffer(labels, np.float32).reshape(len(steps), len(EMOTIONS))  # [step, emotion]
        places = [step.lanes for step in steps]
        taken = _Turn(index, steps, places, rotations, mask, emotion)
        self._run_lanes(taken, memory)
        if NO_LANES in places:
            self._run_windows(taken, memory)

    def _run_lanes(self, turn: "_Turn", memory: BatchMemory) -> None:
        """The steps of bodies with recurrent states: a row of the model for every lane that runs."""
        plan, place = self._plan, np.array(turn.places, np.intp)
        runs = plan.runs.take(place, axis=0)  # [step, lane]
        running = np.flatnonzero(runs)  # [row] step · LANES + lane
        if not len(running):
            return
        step, lane = running // LANES, running % LANES
        restart = None
        if not plan.restarting.isdisjoint(turn.places):
            restart = np.flatnonzero(plan.restart.take(place, axis=0).ravel().take(running))
        at = memory.place(turn.tickets.take(step), lane)
        said, states = self._call(*turn.inputs(step), memory.lanes(at, restart))
        memory.move(at, states)
        blended = _blend(said, runs, running, plan.weight.take(place, axis=0))
        if NO_LANES in turn.places:
            stateful = runs.any(axis=1)
            memory.said[turn.tickets[stateful]] = blended[stateful]
        else:
            memory.said[turn.tickets] = blended

    def _run_windows(self, turn: "_Turn", memory: BatchMemory) -> None:
        """The steps of bodies with a window, those of one length together."""
        by_length: dict[int, list[int]] = {}
        for number, step in enumerate(turn.steps):
            if step.window:
                ticket = int(turn.tickets[number])
                history = memory.histories.get(ticket, NO_HISTORY)
                memory.histories[ticket] = history.then(turn.rotations[number], turn.mask[number], step.window)
                by_length.setdefault(len(memory.histories[ticket]), []).append(number)
        for length, numbers in by_length.items():
            rows = turn.tickets[numbers]
            poses = [memory.histories[ticket] for ticket in rows.tolist()]
            outputs = self.model.run(
                np.stack([pose.rotations for pose in poses]),
                np.stack([pose.mask for pose in poses]),
                np.repeat(turn.emotion[numbers][:, None], length, axis=1),
                self.model.zero_states(len(numbers)),
            )
            memory.said[rows] = _said(outputs, slice(None), -1)

    def _call(
        self,
        rotations: Floats,  # [row, joint, 4]
        mask: Floats,  # [row, joint]
        emotion: Floats,  # [row, emotion]
        states: States,
    ) -> tuple[Floats, States]:
        """One step of the model, cut into calls: what is said [row, 1 + emotion], next states."""
        if len(rotations) <= MOST_ROWS:
            return self._call_once(rotations, mask, emotion, states)
        parts = [
            self._call_once(
                rotations[cut], mask[cut], emotion[cut], {name: state[cut] for name, state in states.items()}
            )
            for cut in (slice(first, first + MOST_ROWS) for first in range(0, len(rotations), MOST_ROWS))
        ]
        return (
            np.concatenate([said for said, _ in parts]),
            {name: np.concatenate([after[name] for _, after in parts]) for name in states},
        )

    def _call_once(self, rotations: Floats, mask: Floats, emotion: Floats, states: States) -> tuple[Floats, States]:
        """As `_call`, of no more rows than the model is given at once."""
        count = len(rotations)
        spare = -count % self._row_multiple
        if not spare:
            outputs = self.model.run(rotations[:, None], mask[:, None], emotion[:, None], states)
            return _said(outputs, slice(None), 0), outputs.states
        outputs = self.model.run(
            _pad(rotations, spare)[:, None],
            _pad(mask, spare)[:, None],
            _pad(emotion, spare)[:, None],
            {name: _pad(state, spare) for name, state in states.items()},
        )
        after = {name: state[:count] for name, state in outputs.states.items()}
        return _said(outputs, slice(count), 0), after


class _Turn(NamedTuple):
    """One grid step of some of a batch's tickets."""

    tickets: npt.NDArray[np.intp]  # [step] whose it is, by number
    steps: Sequence[Step]
    places: Sequence[int]  # [step] row of the lane plan
    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]
    emotion: Floats  # [step, emotion]

    def inputs(self, step: npt.NDArray[np.intp]) -> tuple[Floats, Floats, Floats]:
        """Rotations, mask and emotion of the rows of these steps [row]."""
        return self.rotations.take(step, axis=0), self.mask.take(step, axis=0), self.emotion.take(step, axis=0)


def _believed(
    tickets: Sequence[Ticket], came: Poses, old: Poses, jumps: npt.NDArray[np.int64]
) -> tuple[Poses, npt.NDArray[np.int64] | None, list[int]]:
    """Poses less what flipped, the new counts (None: none changed), and how many joints of each ticket flipped."""
    noisy = [ticket.source.skeleton.noisy for ticket in tickets]
    if True not in noisy:
        return came, None, [0] * len(tickets)
    came, counts, rejected = reject_jumps(came, old, jumps, np.array(noisy))
    return came, counts, np.count_nonzero(rejected, axis=1).tolist()


def _posed(tickets: Sequence[Ticket]) -> npt.NDArray[np.intp] | None:
    """The tickets with a pose; None where all have one."""
    posed = [row for row, ticket in enumerate(tickets) if ticket.pose is not None]
    return None if len(posed) == len(tickets) else np.array(posed, np.intp)


def _said(outputs: Outputs, rows: slice, time: int) -> Floats:
    """Intensity, and that under every emotion, at one time: [row, 1 + emotion].

    Raises:
        EngineError: an intensity that is not finite.
    """
    intensity, by_emotion = outputs.intensity[rows, time], outputs.intensity_by_emotion[rows, time]
    if not np.isfinite(intensity).all():
        raise EngineError("the model gave an intensity that is not finite; the body starts anew")
    return np.concatenate([intensity[:, None], by_emotion], axis=1)


def _blend(
    values: Floats,  # [row, k]
    runs: npt.NDArray[np.bool_],  # [step, lane]
    running: npt.NDArray[np.intp],  # [row] step · LANES + lane
    weight: npt.NDArray[np.float64],  # [step, lane]
) -> npt.NDArray[np.float64]:
    """Values of the lanes that run, weighted into one a step: [step, k]."""
    if len(running) == runs.size:  # every lane of every step runs
        spread = values
    else:
        spread = np.zeros((runs.size, values.shape[1]), np.float32)
        spread[running] = values
    spread = spread.reshape(*runs.shape, -1)
    blended = weight[:, 0, None] * spread[:, 0]
    for lane in range(1, LANES):
        blended += weight[:, lane, None] * spread[:, lane]
    return blended


def _outcomes(tickets: Sequence[Ticket], slots: Slots, memory: BatchMemory, jumped: Sequence[int]) -> list[Outcome]:
    """What became of each ticket, from arrays by ticket."""
    said = memory.said
    columns = zip(tickets, said[:, 0].tolist(), said[:, 1:], memory.records["seen"].tolist(), jumped, strict=True)
    return [
        Outcome(
            None if isnan(intensity) else intensity,  # nan: no step yet
            by_emotion,
            seen,
            jumps,
            None if ticket.checkpoint is None else slots.recall(ticket.slot),
        )
        for ticket, intensity, by_emotion, seen, jumps in columns
    ]


def _pad(rows: Floats, spare: int) -> Floats:
    return np.concatenate([rows, np.repeat(rows[:1], spare, axis=0)])
