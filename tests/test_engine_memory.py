"""A batch's memory: what it moves shows in the slots once all is stored, whether it works on copies or not."""

import numpy as np
import pytest

from bodies import model
from fervor.engine.memory import BatchMemory
from fervor.engine.slots import Slots

ROWS = np.array([4, 1, 2], np.intp)
TICKETS, LANE = np.array([0, 0, 2], np.intp), np.array([0, 1, 1], np.intp)


def filled() -> Slots:
    slots = Slots(6, model().metadata)
    random = np.random.default_rng(0)
    for state in slots.states.values():
        state[:] = random.standard_normal(state.shape)
    return slots


def contents(slots: Slots) -> list[bytes]:
    arrays = (*slots.states.values(), slots.intensity, slots.by_emotion)
    return [array.tobytes() for array in arrays]


@pytest.mark.parametrize("copied", [False, True])
def test_lanes_are_those_of_the_tickets_slots(copied: bool) -> None:
    slots = filled()
    states = BatchMemory(slots, ROWS, copied=copied).lanes(TICKETS, LANE)
    for name, state in states.items():
        assert np.array_equal(state, slots.states[name][[4, 4, 2], [0, 1, 1]])
        state[:] = 0.0  # a copy: the slots keep theirs
        assert slots.states[name][4, 0].any()


@pytest.mark.parametrize("copied", [False, True])
def test_nothing_shows_before_it_is_stored_and_then_all_does(copied: bool) -> None:
    slots, untouched = filled(), filled()
    memory = BatchMemory(slots, ROWS, copied=copied)
    moved = {name: state + 1.0 for name, state in memory.lanes(TICKETS, LANE).items()}
    memory.move(TICKETS, LANE, moved)
    memory.intensity[:] = 0.5
    assert contents(slots) == contents(untouched)
    memory.store()
    for name, state in untouched.states.items():
        state[[4, 4, 2], [0, 1, 1]] += 1.0
        assert np.array_equal(slots.states[name], state)
    assert np.flatnonzero(slots.intensity == 0.5).tolist() == [1, 2, 4]


def test_on_copies_a_second_step_goes_on_from_the_first() -> None:
    slots = filled()
    memory = BatchMemory(slots, ROWS, copied=True)
    memory.move(TICKETS, LANE, {name: state + 1.0 for name, state in memory.lanes(TICKETS, LANE).items()})
    again = memory.lanes(TICKETS, LANE)
    for name, state in again.items():
        assert np.array_equal(state, slots.states[name][[4, 4, 2], [0, 1, 1]] + 1.0)
