"""What a batch changes: all of it, or nothing."""

from typing import Any

import numpy as np
import numpy.typing as npt

from fervor.engine.history import History
from fervor.engine.posing import Poses
from fervor.engine.slots import Slots
from fervor.model import Floats
from fervor.skeletons.rig import UPPER_BODY

States = dict[str, Floats]  # name → [row, *shape]

Index = npt.NDArray[np.intp]


_UPPER_BODY = np.array(UPPER_BODY)


class BatchMemory:
    """The memory of a batch's bodies, by ticket.

    Records are copies, written back by `store`. States are read from the slots and put there with every step; `undo`
    takes that back.
    """

    def __init__(self, slots: Slots, rows: Index) -> None:
        """Begin with what the slots hold.

        Args:
            slots: of the engine.
            rows: [ticket] slot.
        """
        self._slots = slots
        self._rows = rows
        self._before: list[tuple[Index, States]] = []  # lanes as they were, in the order in which they changed
        self.records = slots.read(rows)  # [ticket]
        self.said: npt.NDArray[np.float64] = self.records["said"]  # [ticket, 1 + emotion], a view
        self.histories = self._histories()

    def _histories(self) -> dict[int, History]:
        """Ticket → last poses, of bodies with a window."""
        kept = self._slots.histories
        return {at: kept[slot] for at, slot in enumerate(self._rows.tolist()) if slot in kept} if kept else {}

    def lanes(self, tickets: Index, lane: Index) -> Index:
        """The numbers of these lanes of tickets, both [row]: see `Slots.take`."""
        numbers: Index = self._slots.lanes[self._rows.take(tickets), lane]
        return numbers

    def all_lanes(self, tickets: Index) -> Index:
        """The numbers of all lanes of these tickets, ticket by ticket."""
        return self._slots.lanes.take(self._rows.take(tickets), axis=0).ravel()

    def take(self, at: Index, restart: Index | None = None) -> States:
        """Copies of the states of lanes, to be followed by `put`.

        Args:
            at: [row] their numbers.
            restart: those of the rows that begin from zero.
        """
        states = self._slots.take(at)
        if restart is not None:
            self._before.append((at[restart], {name: state[restart] for name, state in states.items()}))
            for state in states.values():
                state[restart] = 0.0
        self._before.append((at, states))
        return states

    def put(self, at: Index, states: States) -> None:
        """What a step made of these lanes [row]."""
        self._slots.put(at, states)

    def undo(self) -> None:
        """Make the slots hold what they held."""
        while self._before:
            self._slots.put(*self._before.pop())

    def keep(
        self,
        posed: Index | None,
        new: Poses,
        *,
        jumps: npt.NDArray[np.int64] | None,
        hinges: npt.NDArray[np.float64] | None,
    ) -> None:
        """Take the newest poses into the records of those tickets that have one.

        Args:
            posed: those tickets, by number; None for all.
            new: the poses, [ticket].
            jumps: [ticket, joint] frames rejected in a row; None where no source is noisy.
            hinges: [ticket, limb, bone, 3]; None where no sensor has any.
        """
        changed: dict[str, npt.NDArray[Any] | None] = {
            "pose": new.rotations,
            "observed": new.observed,
            "seen": np.add.reduce(new.observed.take(_UPPER_BODY, axis=1), axis=1),
            "jumps": jumps,
            "hinges": hinges,
        }
        for name, values in changed.items():
            if values is not None and posed is None:
                self.records[name] = values
            elif values is not None:
                self.records[name][posed] = values[posed]

    def store(self) -> None:
        """Make records and histories what the slots hold."""
        self._slots.write(self._rows, self.records)
        for ticket, history in self.histories.items():
            self._slots.histories[int(self._rows[ticket])] = history
