"""What a batch changes, kept apart from the slots until all of it succeeded."""

import numpy as np
import numpy.typing as npt

from fervor.engine.history import History
from fervor.engine.slots import Slots
from fervor.model import Floats
from fervor.session.lanes import LANES

States = dict[str, Floats]  # name → [row, *shape]

Index = npt.NDArray[np.intp]


class BatchMemory:
    """The memory of a batch's bodies, by ticket.

    Where every body takes one step at most, states are read from the slots and written back once; only where one takes
    several does the batch work on copies.
    """

    def __init__(self, slots: Slots, rows: Index, *, copied: bool) -> None:
        """Begin with what the slots hold.

        Args:
            slots: of the engine.
            rows: [ticket] slot.
            copied: whether a lane's states are put more than once before `store`.
        """
        self._slots = slots
        self._rows = rows
        self._places = np.arange(len(rows)) if copied else rows  # [ticket] where its states stand in `_states`
        self._states = {name: state[rows] for name, state in slots.states.items()} if copied else slots.states
        self._copied = copied
        self._moved: list[tuple[Index, States]] = []  # rows of flattened slots, and what becomes of them
        self.histories = self._histories()
        self.intensity = slots.intensity[rows]  # [ticket]
        self.by_emotion = slots.by_emotion[rows]  # [ticket, emotion]

    def _histories(self) -> dict[int, History]:
        """Ticket → last poses, of bodies with a window."""
        kept = self._slots.histories
        return {at: kept[slot] for at, slot in enumerate(self._rows.tolist()) if slot in kept} if kept else {}

    def lanes(self, tickets: Index, lane: Index) -> States:
        """Copies of the states of these lanes, both [row]: name → [row, *shape]."""
        at = self._places[tickets] * LANES + lane
        return {name: _flat(state).take(at, axis=0) for name, state in self._states.items()}

    def move(self, tickets: Index, lane: Index, states: States) -> None:
        """What a step made of these lanes, both [row]."""
        at = self._places[tickets] * LANES + lane
        if self._copied:
            _put(self._states, at, states)
        else:
            self._moved.append((at, states))

    def store(self) -> None:
        """Make it what the slots hold."""
        if self._copied:
            for name, state in self._states.items():
                self._slots.states[name][self._rows] = state
        for at, states in self._moved:
            _put(self._slots.states, at, states)
        for ticket, history in self.histories.items():
            self._slots.histories[int(self._rows[ticket])] = history
        self._slots.intensity[self._rows], self._slots.by_emotion[self._rows] = self.intensity, self.by_emotion


def _flat(state: Floats) -> Floats:
    """States [place, lane, *shape] as [place · lane, *shape], a view."""
    return state.reshape(-1, *state.shape[2:])


def _put(states: States, at: Index, values: States) -> None:
    for name, state in states.items():
        _flat(state)[at] = values[name]
