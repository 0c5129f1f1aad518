"""Runs tickets: adapts their poses, puts them on the grid, steps the model for all bodies at once, keeps the states.

A batch either changes all of its bodies' slots or, if the model fails, none of them. The result of a ticket does not
depend on what else is in its batch: the model was checked for that at start-up, all else is elementwise.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.engine.history import NO_HISTORY
from fervor.engine.memory import BatchMemory, States
from fervor.engine.outcomes import outcomes_of
from fervor.engine.posing import Poses, adapt_all, hold, reject_jumps
from fervor.engine.sequences import is_sequence, run_sequences
from fervor.engine.slots import Slots
from fervor.engine.stepping import blend, emotions_at, poses_at, spoken
from fervor.errors import EngineError
from fervor.model import Floats, Model
from fervor.session.checkpoint import Memory
from fervor.session.events import Outcome, Step, Ticket
from fervor.session.lanes import LANES, NO_LANES, lane_plan

MOST_STEPS = 128
"""Steps in one call of the model, of up to `LANES` rows each; larger batches are cut, for cache and latency."""


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

    def is_sequence(self, tickets: Sequence[Ticket]) -> bool:
        """Whether tickets of one slot, in their order, may run together: see `run_sequences`."""
        return self._row_multiple == 1 and is_sequence(tickets, self._plan)

    def run_sequences(self, bodies: Sequence[Sequence[Ticket]]) -> list[list[Outcome]]:
        """The outcomes of each body's tickets, as of one `run` after the other.

        Args:
            bodies: of each the tickets, in order, which `is_sequence`.

        Raises:
            EngineError: the model failed on one of them; nothing was done.
        """
        return run_sequences(bodies, self.model, self.slots, self._plan)

    def _run(self, tickets: Sequence[Ticket]) -> list[Outcome]:
        rows = np.array([ticket.slot for ticket in tickets], np.intp)  # [ticket] slot
        fresh = [ticket.slot for ticket in tickets if ticket.fresh]
        if fresh:
            self.slots.clear(fresh)
        memory = BatchMemory(self.slots, rows)
        records = memory.records
        old = Poses(records["pose"], records["observed"])
        came = adapt_all(tickets, records["hinges"])
        poses, jumps, jumped = _believed(tickets, came.poses, old, records["jumps"])
        new = hold(poses, old)
        try:
            for turn in _turns(tickets, old, new):
                self._run_lanes(turn, memory)
                if turn.windows:
                    self._run_windows(turn, memory)
        except BaseException:
            memory.undo()
            raise
        memory.keep(came.posed, new, jumps=jumps, hinges=came.hinges)
        memory.store()
        return outcomes_of(tickets, memory.said, memory.records["seen"], jumped, self.slots)

    def _run_lanes(self, turn: "_Turn", memory: BatchMemory) -> None:
        """The steps of bodies with recurrent states: a row of the model for every lane that runs."""
        plan, place = self._plan, np.array(turn.places, np.intp)
        weight = plan.weight.take(place, axis=0)  # [step, lane]
        if plan.full.issuperset(turn.places):  # as of bodies that are older than a few seconds
            running = None
            at, inputs = memory.all_lanes(turn.tickets), turn.inputs_of_all()
        else:
            running = plan.runs.take(place, axis=0).ravel().nonzero()[0]  # [row] step · LANES + lane
            if not len(running):
                return
            step, lane = np.divmod(running, LANES)
            at, inputs = memory.lanes(turn.tickets.take(step), lane), turn.inputs(step)
        restart = None
        if not plan.restarting.isdisjoint(turn.places):
            restarts = plan.restart.take(place, axis=0).ravel()
            restart = np.flatnonzero(restarts if running is None else restarts.take(running))
        said, states = self._call(*inputs, memory.take(at, restart))
        memory.put(at, states)
        if running is not None:
            by_lane = np.zeros((weight.size, said.shape[1]))
            by_lane[running] = said
            said = by_lane
        blended = blend(said.reshape(*weight.shape, -1), weight)
        if turn.windows:
            stateful = plan.runs.take(place, axis=0).any(axis=1)
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
            memory.said[rows] = spoken(outputs.intensity[:, -1], outputs.intensity_by_emotion[:, -1])

    def _call(
        self,
        rotations: Floats,  # [row, joint, 4]
        mask: Floats,  # [row, joint]
        emotion: Floats,  # [row, emotion]
        states: States,
    ) -> tuple[npt.NDArray[np.float64], States]:
        """One step of the model: what is said [row, 1 + emotion], next states."""
        count = len(rotations)
        spare = -count % self._row_multiple
        if not spare:
            outputs = self.model.run(rotations[:, None], mask[:, None], emotion[:, None], states)
            return spoken(outputs.intensity[:, 0], outputs.intensity_by_emotion[:, 0]), outputs.states
        outputs = self.model.run(
            _pad(rotations, spare)[:, None],
            _pad(mask, spare)[:, None],
            _pad(emotion, spare)[:, None],
            {name: _pad(state, spare) for name, state in states.items()},
        )
        after = {name: state[:count] for name, state in outputs.states.items()}
        return spoken(outputs.intensity[:count, 0], outputs.intensity_by_emotion[:count, 0]), after


class _Turn(NamedTuple):
    """One grid step of some of a batch's tickets, at most `MOST_STEPS`."""

    tickets: npt.NDArray[np.intp]  # [step] whose it is, by number
    steps: Sequence[Step]
    places: Sequence[int]  # [step] row of the lane plan
    windows: bool
    """Whether any of them has a window in place of lanes."""
    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]
    emotion: Floats  # [step, emotion]

    def inputs_of_all(self) -> tuple[Floats, Floats, Floats]:
        """Rotations, mask and emotion of the rows of all steps, where every lane runs."""
        return self.rotations.repeat(LANES, axis=0), self.mask.repeat(LANES, axis=0), self.emotion.repeat(LANES, axis=0)

    def inputs(self, step: npt.NDArray[np.intp]) -> tuple[Floats, Floats, Floats]:
        """Rotations, mask and emotion of the rows of these steps [row]."""
        return self.rotations.take(step, axis=0), self.mask.take(step, axis=0), self.emotion.take(step, axis=0)


def _turns(tickets: Sequence[Ticket], old: Poses, new: Poses) -> Iterator[_Turn]:
    """The steps of a batch: the first ones of all tickets, then the second ones of those that have two, and so on."""
    counts = [len(ticket.steps) for ticket in tickets]
    fewest = min(counts)
    for number in range(max(counts)):
        if number < fewest:
            rows = np.arange(len(tickets))
            steps = [ticket.steps[number] for ticket in tickets]
        else:
            rows = np.array([row for row, count in enumerate(counts) if count > number], np.intp)
            steps = [ticket.steps[number] for ticket in tickets if len(ticket.steps) > number]
        for first in range(0, len(steps), MOST_STEPS):
            cut = slice(first, first + MOST_STEPS)
            yield _turn(steps[cut], rows[cut], old, new)


def _turn(steps: Sequence[Step], rows: npt.NDArray[np.intp], old: Poses, new: Poses) -> _Turn:
    """Steps of these tickets [step], given the poses of all."""
    whole = len(rows) == len(new.rotations)
    after = new if whole else new.rows(rows)
    rotations, mask = poses_at(steps, old if whole else old.rows(rows), after)
    places = [step.lanes for step in steps]
    return _Turn(rows, steps, places, NO_LANES in places, rotations, mask, emotions_at(steps))


def _believed(
    tickets: Sequence[Ticket], came: Poses, old: Poses, jumps: npt.NDArray[np.int64]
) -> tuple[Poses, npt.NDArray[np.int64] | None, list[int]]:
    """Poses less what flipped, the new counts (None: none changed), and how many joints of each ticket flipped."""
    noisy = [ticket.source.skeleton.noisy for ticket in tickets]
    if True not in noisy:
        return came, None, [0] * len(tickets)
    came, counts, rejected = reject_jumps(came, old, jumps, np.array(noisy))
    return came, counts, np.count_nonzero(rejected, axis=1).tolist() if rejected.any() else [0] * len(tickets)


def _pad(rows: Floats, spare: int) -> Floats:
    return np.concatenate([rows, np.repeat(rows[:1], spare, axis=0)])
