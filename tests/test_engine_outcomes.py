"""Outcomes from arrays."""

import numpy as np
from msgspec.structs import replace

from bodies import model, terms
from fervor.emotions import EMOTIONS
from fervor.engine.outcomes import outcomes_of
from fervor.engine.slots import Slots
from fervor.session.body import Body


def test_outcomes_are_their_rows_and_a_checkpoint_has_what_the_slot_holds():
    slots = Slots(2, model().metadata)
    tickets = [Body("a", slots.claim(), terms()).snapshot(0.0), Body("b", slots.claim(), terms()).snapshot(0.0)]
    tickets[1] = replace(tickets[1], checkpoint=None)
    said = np.arange(2 * (1 + len(EMOTIONS)), dtype=np.float64).reshape(2, -1)
    said[0, 0] = np.nan
    first, second = outcomes_of(tickets, said, np.array([3, 8]), [1, 0], slots)
    assert (first.intensity, second.intensity) == (None, said[1, 0])
    assert np.array_equal(second.by_emotion, said[1, 1:])
    assert [(each.seen, each.jumped) for each in (first, second)] == [(3, 1), (8, 0)]
    assert first.memory is not None
    assert first.memory.arrays.keys() == slots.recall(0).arrays.keys()
    assert second.memory is None
