"""Scoring over HTTP: what is sent is what the service takes, and it goes on beside live sessions."""

from pathlib import Path

import pytest

from fervor_bench.contestant import CONTESTANTS, Running, started
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.machine import choose_places
from fervor_bench.scoring import measure_beside, measure_rates
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track


def test_every_kind_of_body_is_scored_alone_and_beside_sessions(workshop: Path) -> None:
    places = choose_places()
    with started(CONTESTANTS["fervor"], workshop, places.server) as running:
        rates = measure_rates(running, places.server, 0.1, sequences=1)
        assert {(rate.kind, rate.sequences, rate.frames) for rate in rates.kinds} == {
            ("NPZ", 1, 300),
            ("MessagePack", 1, 300),
            ("JSON", 1, 300),
        }
        assert all(rate.frames_per_second > 0 for rate in rates.kinds)
        assert rates.model_us > 0
        load = Load(2, warmup_s=0.2, seconds=0.5)
        beside = measure_beside(running, Track(workshop, places, Traffic()), load, sequences=1)
    assert beside.requests >= 1
    assert not beside.alone.failures
    assert not beside.beside.failures


def test_a_request_that_is_refused_is_told(start_service) -> None:
    live = start_service(score_max_frames=10)
    host, port = live.address.split(":")
    with pytest.raises(BenchError, match="POST /v1/score/file was answered with 413"):
        measure_rates(Running(host, int(port), pid=1), choose_places().server, 0.1, sequences=1)
