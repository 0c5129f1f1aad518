"""The collector's pauses are noted by the process that has them, and read for the windows that were measured."""

import gc
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fervor_bench.pauses import RECORD, Pauses, note_pauses, read_pauses


@pytest.fixture(autouse=True)
def callbacks() -> Iterator[None]:
    before = list(gc.callbacks)
    yield
    gc.callbacks[:] = before


def test_every_collection_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "pauses"
    gc.disable()
    try:
        note_pauses(path)
        begin = time.monotonic()
        for generation in (0, 0, 1, 2):
            gc.collect(generation)
        end = time.monotonic()
    finally:
        gc.enable()
    told = read_pauses(path, [(begin, end)])
    assert told is not None
    assert (told.young, told.older) == (2, 2)
    assert 0.0 < told.longest_ms <= 1000.0 * (end - begin)
    assert 0.0 < told.share <= 1.0


def test_what_is_outside_the_windows_does_not_count(tmp_path: Path) -> None:
    path = tmp_path / "pauses"
    np.array([(1.0, 0.5, 2), (3.0, 0.25, 0), (9.0, 0.125, 1)], RECORD).tofile(path)
    assert read_pauses(path, [(2.0, 4.0), (8.0, 11.0)]) == Pauses(young=1, older=1, longest_ms=250.0, share=0.075)
    assert read_pauses(path, [(4.0, 5.0)]) == Pauses(young=0, older=0, longest_ms=0.0, share=0.0)


def test_who_notes_none_is_told_apart_from_who_has_none(tmp_path: Path) -> None:
    assert read_pauses(tmp_path / "pauses", [(0.0, 1.0)]) is None
