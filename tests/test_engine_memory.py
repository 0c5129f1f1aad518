"""A batch's memory: what it moves shows in the slots, or all of it is undone."""

import numpy as np

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
    everyone = np.arange(slots.capacity)
    return [slots.read(everyone).tobytes(), *(state.tobytes() for state in slots.states.values())]


def test_lanes_are_those_of_the_tickets_slots() -> None:
    slots = filled()
    memory = BatchMemory(slots, ROWS)
    for name, state in memory.take(memory.lanes(TICKETS, LANE)).items():
        assert np.array_equal(state, slots.states[name][[4, 4, 2], [0, 1, 1]])
        state[:] = 0.0  # a copy: the slots keep theirs
        assert slots.states[name][4, 0].any()


def test_all_lanes_are_every_ticket_with_every_lane() -> None:
    memory = BatchMemory(filled(), ROWS)
    tickets = np.array([2, 0])
    assert memory.all_lanes(tickets).tolist() == memory.lanes(tickets.repeat(2), np.tile([0, 1], 2)).tolist()


def step(memory: BatchMemory, tickets: np.ndarray, lane: np.ndarray, restart: np.ndarray | None = None) -> None:
    """A step that adds one to the states of these lanes."""
    at = memory.lanes(tickets, lane)
    memory.put(at, {name: state + 1.0 for name, state in memory.take(at, restart).items()})


def test_steps_go_on_from_one_another() -> None:
    slots, untouched = filled(), filled()
    memory = BatchMemory(slots, ROWS)
    step(memory, TICKETS, LANE)
    step(memory, TICKETS[:1], LANE[:1])
    memory.said[:, 0] = 0.5
    memory.store()
    for name, state in untouched.states.items():
        state[[4, 4, 2], [0, 1, 1]] += 1.0
        state[4, 0] += 1.0
        assert np.array_equal(slots.states[name], state)
    assert np.flatnonzero(slots.read(np.arange(6))["said"][:, 0] == 0.5).tolist() == [1, 2, 4]


def test_lanes_that_restart_begin_from_zero() -> None:
    slots = filled()
    memory = BatchMemory(slots, ROWS)
    states = memory.take(memory.lanes(TICKETS, LANE), np.array([1]))
    assert all(not state[1].any() and state[0].any() and state[2].any() for state in states.values())


def test_what_is_undone_leaves_no_trace() -> None:
    slots, untouched = filled(), filled()
    memory = BatchMemory(slots, ROWS)
    step(memory, TICKETS, LANE)
    step(memory, TICKETS, LANE, np.array([0, 2]))
    step(memory, TICKETS[1:], LANE[1:])
    memory.said[:], memory.records["pose"] = 0.5, 0.25
    assert contents(slots) != contents(untouched)
    memory.undo()
    assert contents(slots) == contents(untouched)
