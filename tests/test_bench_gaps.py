"""What a machine takes away from who is busy. No test depends on how much that is."""

import os
import subprocess
import sys
import time

import pytest

from fervor_bench.errors import BenchError
from fervor_bench.gaps import LEAST_S, Gap, measure_interruptions, note_gaps, summarise
from fervor_bench.machine import Gaps, Interruptions, pinned


def test_gaps_are_summed_and_the_longest_is_told() -> None:
    gaps = summarise([Gap(0.002, switched=True), Gap(0.008, switched=False)], 2.0)
    assert gaps.longest_ms == pytest.approx(8.0)
    assert gaps.share == pytest.approx(0.005)
    assert gaps.others_share == pytest.approx(0.001)
    assert summarise([], 2.0) == Gaps(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("others", "words"), [(0.01, "mostly by other programs"), (0.001, "mostly by the machine's host")]
)
def test_a_sentence_says_how_long_how_much_and_who(others: float, words: str) -> None:
    told = Interruptions(2, Gaps(9.94, 0.0123, others), Gaps(0.0, 0.0, 0.0)).sentence
    assert told.startswith("With 2 processors busy one of them is taken away for up to 9.9 ms, 1.2% of the time")
    assert words in told
    assert "with one busy, not at all" in told


def test_who_shares_a_processor_is_told_who_has_it() -> None:
    processor = min(os.sched_getaffinity(0))
    with pinned(processor):
        rival = subprocess.Popen([sys.executable, "-I", "-S", "-c", "while True: pass"])
    try:
        found = measure_interruptions([processor], 1.0)
    finally:
        rival.kill()
        rival.wait()
    assert found.alone.longest_ms > 1.0
    assert found.alone.others_share > found.alone.share / 2
    assert "mostly by other programs" in found.sentence


def test_only_gaps_are_noted() -> None:
    gaps = note_gaps(time.monotonic(), 0.2)
    assert all(gap.seconds > LEAST_S for gap in gaps)


def test_all_processors_are_looked_at_and_one_alone() -> None:
    processors = sorted(os.sched_getaffinity(0))[:2]
    found = measure_interruptions(processors, 0.2)
    assert found.processors == len(processors)
    for gaps in (found.together, found.alone):
        assert 0.0 <= gaps.others_share <= gaps.share
        assert (gaps.longest_ms > 0) == (gaps.share > 0)


def test_a_program_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(BenchError, match="could not be looked at"):
        measure_interruptions([min(os.sched_getaffinity(0))], 0.1)
