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


def test_clear_forgets_what_a_slot_held():
    slots = Slots(3, model().metadata)
    slots.pose[:], slots.observed[:], slots.jumps[:], slots.intensity[:], slots.seen[:] = 0.5, True, 3, 0.9, 9
    slots.clear(np.array([1]))
    assert slots.pose[1].tolist() == [[0, 0, 0, 1]] * 13
    assert not slots.observed[1].any()
    assert np.isnan(slots.intensity[1])
    assert slots.intensity[0] == 0.9
    assert (slots.seen[1], slots.seen[2]) == (0, 9)


def test_arrays_are_as_large_as_the_metadata_says():
    slots = Slots(5, model().metadata)
    assert {name: state.shape[2:] for name, state in slots.states.items()} == {
        state.name: state.shape for state in model().metadata.states
    }
