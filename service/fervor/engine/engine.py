"""Runs tickets: adapts their poses, puts them on the grid, steps the model for all bodies at once, keeps the states.

A batch either changes all of its bodies' slots or, if the model fails, none of them. The result of a ticket does not
depend on what else is in its batch: the model was checked for that at start-up, all else is elementwise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor.engine.history import NO_HISTORY, History
from fervor.engine.posing import Poses, adapt_all, between, hold, reject_jumps
from fervor.engine.slots import Slots
from fervor.errors import EngineError
from fervor.model import Floats, Model
from fervor.session.checkpoint import Memory
from fervor.session.events import Outcome, Step, Ticket
from fervor.session.lanes import LANES
from fervor.skeletons.rig import UPPER_BODY

MOST_ROWS = 256
"""Rows in one call of the model; larger batches are cut, for cache and latency."""

States = dict[str, Floats]  # name → [row, *shape]


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
        posed = np.array([ticket.pose is not None for ticket in tickets], np.bool_)  # [ticket]
        noisy = np.array([ticket.source.skeleton.noisy for ticket in tickets], np.bool_)  # [ticket]
        slots.clear(rows[fresh])
        old = Poses(slots.pose[rows], slots.observed[rows])
        came, hinges = adapt_all(tickets, slots.hinges[rows])
        new, jumps, rejected = reject_jumps(came, old, slots.jumps[rows], noisy)
        new = hold(new, old)
        memory = _Memory.of(slots, rows)
        for turn in range(max(len(ticket.steps) for ticket in tickets)):
            self._turn(tickets, turn, old, new, memory)
        moved = rows[posed]
        slots.pose[moved], slots.observed[moved] = new.rotations[posed], new.observed[posed]
        slots.jumps[moved], slots.hinges[moved] = jumps[posed], hinges[posed]
        slots.seen[moved] = new.observed[posed][:, UPPER_BODY].sum(axis=1)
        memory.store(slots, rows)
        jumped = np.where(posed, rejected.sum(axis=1), 0)
        for row, slot in enumerate(rows.tolist()):
            known = not np.isnan(memory.intensity[row])
            yield Outcome(
                float(memory.intensity[row]) if known else None,
                memory.by_emotion[row],
                int(slots.seen[slot]),
                int(jumped[row]),
                slots.recall(slot) if tickets[row].checkpoint is not None else None,
            )

    def _turn(self, tickets: Sequence[Ticket], number: int, old: Poses, new: Poses, memory: "_Memory") -> None:
        """One grid step of every ticket that has a step `number`."""
        live = [row for row, ticket in enumerate(tickets) if len(ticket.steps) > number]
        steps = [tickets[row].steps[number] for row in live]
        index = np.array(live, np.intp)
        rotations, mask = between(
            Poses(old.rotations[index], old.observed[index]),
            Poses(new.rotations[index], new.observed[index]),
            np.array([step.fraction for step in steps]),
            np.array([step.held for step in steps]),
        )
        emotion = np.stack([step.label.vector for step in steps])  # [step, emotion]
        taken = _Turn(index, steps, rotations, mask, emotion)
        self._run_lanes(taken, memory)
        self._run_windows(taken, memory)

    def _run_lanes(self, turn: "_Turn", memory: "_Memory") -> None:
        """The steps of bodies with recurrent states."""
        lanes = _LaneRows.of(turn.steps)
        if not len(lanes.step):
            return
        at = (turn.index[lanes.step], lanes.lane)
        states = {name: state[at] for name, state in memory.states.items()}
        for state in states.values():
            state[lanes.restart] = 0.0
        intensity, by_emotion, states = self._call(
            turn.rotations[lanes.step], turn.mask[lanes.step], turn.emotion[lanes.step], states
        )
        for name, state in states.items():
            memory.states[name][at] = state
        stateful = np.array([bool(step.schedule) for step in turn.steps])
        rows = turn.index[stateful]
        memory.intensity[rows] = lanes.blend(intensity[:, None], len(turn.steps))[stateful, 0]
        memory.by_emotion[rows] = lanes.blend(by_emotion, len(turn.steps))[stateful]

    def _run_windows(self, turn: "_Turn", memory: "_Memory") -> None:
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
        parts = []
        for first in range(0, len(rotations), MOST_ROWS):
            cut = slice(first, first + MOST_ROWS)
            count = len(rotations[cut])
            spare = -count % self._row_multiple
            outputs = self.model.run(
                _pad(rotations[cut], spare)[:, None],
                _pad(mask[cut], spare)[:, None],
                _pad(emotion[cut], spare)[:, None],
                {name: _pad(state[cut], spare) for name, state in states.items()},
            )
            parts.append(
                (_finite(outputs.intensity[:count, 0]), outputs.intensity_by_emotion[:count, 0], outputs.states, count)
            )
        return (
            np.concatenate([part[0] for part in parts]),
            np.concatenate([part[1] for part in parts]),
            {name: np.concatenate([part[2][name][: part[3]] for part in parts]) for name in states},
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """One grid step of some of a batch's tickets."""

    index: npt.NDArray[np.intp]  # [step] its ticket
    steps: Sequence[Step]
    rotations: Floats  # [step, joint, 4] xyzw
    mask: Floats  # [step, joint]
    emotion: Floats  # [step, emotion]


@dataclass(frozen=True, slots=True, eq=False)
class _Memory:
    """Working copies of the batch's slots, stored only when the whole batch succeeded."""

    states: States  # name → [ticket, lane, *shape]
    histories: dict[int, History]  # ticket → last poses, windows only
    intensity: npt.NDArray[np.float64]  # [ticket]
    by_emotion: npt.NDArray[np.float64]  # [ticket, emotion]

    @classmethod
    def of(cls, slots: Slots, rows: npt.NDArray[np.intp]) -> "_Memory":
        states = {name: state[rows] for name, state in slots.states.items()}
        places = enumerate(rows.tolist())
        histories = {at: slots.histories[slot] for at, slot in places if slot in slots.histories}
        return cls(states, histories, slots.intensity[rows], slots.by_emotion[rows])

    def store(self, slots: Slots, rows: npt.NDArray[np.intp]) -> None:
        for name, state in self.states.items():
            slots.states[name][rows] = state
        for at, history in self.histories.items():
            slots.histories[int(rows[at])] = history
        slots.intensity[rows], slots.by_emotion[rows] = self.intensity, self.by_emotion


@dataclass(frozen=True, slots=True, eq=False)
class _LaneRows:
    """The rows of one model call: every lane that runs in every step."""

    step: npt.NDArray[np.intp]  # [row] which step
    lane: npt.NDArray[np.intp]  # [row]
    restart: npt.NDArray[np.bool_]  # [row]
    weight: npt.NDArray[np.float64]  # [row]

    @classmethod
    def of(cls, steps: Sequence[Step]) -> "_LaneRows":
        rows = [(number, lane) for number, step in enumerate(steps) for lane in step.schedule]
        return cls(
            np.array([number for number, _ in rows], np.intp),
            np.array([lane.lane for _, lane in rows], np.intp),
            np.array([lane.restart for _, lane in rows], np.bool_),
            np.array([lane.weight for _, lane in rows], np.float64),
        )

    def blend(self, values: Floats, steps: int) -> npt.NDArray[np.float64]:
        """Values [row, k] of the lanes, weighted into one a step: [step, k]."""
        blended = np.zeros((steps, values.shape[1]))
        for lane in range(LANES):  # a step has each lane once, so no two rows meet in one sum
            mine = self.lane == lane
            blended[self.step[mine]] += self.weight[mine, None] * values[mine]
        return blended


def _finite(intensity: Floats) -> Floats:
    if not np.isfinite(intensity).all():
        raise EngineError("the model gave an intensity that is not finite; the body starts anew")
    return intensity


def _pad(rows: Floats, spare: int) -> Floats:
    return np.concatenate([rows, np.repeat(rows[:1], spare, axis=0)]) if spare else rows
