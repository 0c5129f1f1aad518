"""Slots are claimed, cleared and released."""

import numpy as np
import pytest

from bodies import model
from fervor.engine.slots import Slots
from fervor.errors import Overloaded


def test_claim_until_full_then_say_so():
    slots = Slots(3, model().metadata)
    assert sorted(slots.claim() for _ in range(3)) == [0, 1, 2]
    assert slots.taken == 3
    with pytest.raises(Overloaded, match="all 3 bodies") as caught:
        slots.claim()
    assert caught.value.retry_after
    slots.release(1)
    assert slots.claim() == 1


def filled(capacity: int) -> Slots:
    """Slots that hold something everywhere."""
    slots = Slots(capacity, model().metadata)
    everyone = np.arange(capacity)
    records = slots.read(everyone)
    records["pose"], records["observed"], records["jumps"], records["said"], records["seen"] = 0.5, True, 3, 0.9, 9
    slots.write(everyone, records)
    return slots


def test_clear_forgets_what_a_slot_held():
    slots = filled(3)
    slots.clear([1])
    assert slots.pose[1].tolist() == [[0, 0, 0, 1]] * 13
    assert not slots.observed[1].any()
    before, cleared, after = slots.read(np.arange(3))
    assert np.isnan(cleared["said"][0])
    assert (cleared["seen"], cleared["jumps"].any()) == (0, False)
    assert before["said"][0] == after["said"][0] == 0.9


def test_what_is_written_is_what_is_read_and_seen_by_who_watches():
    slots = filled(4)
    rows = np.array([3, 1])
    records = slots.read(rows)
    records["pose"][0], records["said"][1] = 0.25, np.arange(12)
    assert slots.pose[3].min() == 0.5  # copies, until they are written
    slots.write(rows, records)
    assert slots.pose[3].max() == 0.25
    assert slots.by_emotion[1].tolist() == [*range(1, 12)]
    assert np.array_equal(slots.read(rows), records)
    assert np.array_equal(slots.pose[[0, 2]], np.full((2, 13, 4), 0.5))


def test_a_slot_restored_holds_what_was_recalled_to_the_bit():
    slots, random = filled(3), np.random.default_rng(0)
    for state in slots.states.values():
        state[:] = random.standard_normal(state.shape)
    memory = slots.recall(1)
    other = Slots(2, model().metadata)
    other.restore(1, memory)
    assert other.read(np.array([1])).tobytes() == slots.read(np.array([1])).tobytes()
    assert all(other.states[name][1].tobytes() == state[1].tobytes() for name, state in slots.states.items())
    assert other.recall(1).arrays.keys() == memory.arrays.keys()


def test_arrays_are_as_large_as_the_metadata_says():
    slots = Slots(5, model().metadata)
    assert {name: state.shape[2:] for name, state in slots.states.items()} == {
        state.name: state.shape for state in model().metadata.states
    }
