"""The tables of `make bench` are made."""

import pytest

from fervor.skeletons.catalog import SKELETONS
from fervor_bench import frame_cost


def test_costs_are_told_for_batches_and_skeletons(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_cost, "BATCHES", (1, 2))
    monkeypatch.setattr(frame_cost, "FRAMES", 3)
    monkeypatch.setattr(frame_cost, "ROUNDS", 1)
    batching, adapting = frame_cost.frame_costs()
    assert (batching.row_count, adapting.row_count) == (2, len(SKELETONS))
