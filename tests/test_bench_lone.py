"""A session alone, on a processor that sleeps and on one that does not."""

import os
from pathlib import Path

import pytest

from fervor_bench.contestant import CONTESTANTS, started
from fervor_bench.lone import kept_awake, measure_lone
from fervor_bench.machine import choose_places
from fervor_bench.plan import Plan
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track


def test_one_session_is_measured_three_ways(workshop: Path) -> None:
    places = choose_places()
    with started(CONTESTANTS["floor"], workshop, places.server) as running:
        lone = measure_lone(running, Track(workshop, places, Traffic(checkpoints=False)), Plan(seconds=0.3, lone_s=0.5))
    assert lone.awake is not None
    assert [trial.load.sessions for trial in lone.trials] == [1, 1, 1]
    assert [trial.load.loop for trial in lone.trials] == ["open", "open", "closed"]
    for trial in lone.trials:
        assert trial.failures == ()
        assert trial.unanswered == 0
        assert trial.load.waits == "spin"


def test_what_keeps_a_processor_awake_gives_way_to_all_else() -> None:
    processor = choose_places().server
    with kept_awake(processor) as keeper:
        assert os.sched_getscheduler(keeper) == os.SCHED_IDLE
        assert os.sched_getaffinity(keeper) == {processor}
    with pytest.raises(ProcessLookupError):
        os.kill(keeper, 0)
