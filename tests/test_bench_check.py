"""Whoever computes something else is not measured; floor and naive service compute what the model does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import speaking
from fervor.model import default_model_path
from fervor_bench.check import check_estimates
from fervor_bench.contestant import CONTESTANTS, Running, started
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.machine import choose_places
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track
from fervor_bench.weights import write_weights
from fervor_export.network import NetworkConfig
from networks import model_bytes

PLAIN = Traffic(checkpoints=False)


def test_estimates_of_another_model_are_refused() -> None:
    with speaking.speaking() as running, pytest.raises(BenchError, match="estimates differ from the model's by 0"):
        check_estimates(running, PLAIN, grid=True, states=2)


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
@pytest.mark.parametrize("jitter_s", [0.0, 0.004, 0.012])
def test_the_service_passes(live, encoding, jitter_s: float) -> None:
    host, port = live.address.split(":")
    traffic = replace(PLAIN, encoding=encoding, jitter_s=jitter_s)
    assert check_estimates(Running(host, int(port)), traffic, grid=True, states=2) < 1e-5


@pytest.mark.parametrize("name", ["naive", "naive-tuned", "floor", "floor-two"])
@pytest.mark.parametrize("emotion", ["joy", "sadness", "unknown"])
def test_others_compute_what_the_model_does(workshop: Path, name: str, emotion: str) -> None:
    contestant = CONTESTANTS[name]
    traffic = replace(PLAIN, encoding=contestant.encodings[0], emotion=emotion)
    with started(contestant, workshop, choose_places().server) as running:
        assert check_estimates(running, traffic, grid=False, states=contestant.states) < 1e-4
        assert running.start_s is not None


@pytest.mark.parametrize("frames", [6, 20])
@pytest.mark.parametrize(("name", "states"), [("floor", 1), ("floor-two", 2)])
def test_the_floor_takes_several_frames_a_message(workshop: Path, name: str, states: int, frames: int) -> None:
    traffic = replace(PLAIN, frames_per_message=frames)
    with started(CONTESTANTS[name], workshop, choose_places().server) as running:
        assert check_estimates(running, traffic, grid=False, states=states) < 1e-4


def test_who_keeps_one_state_is_not_taken_for_two(workshop: Path) -> None:
    with (
        started(CONTESTANTS["floor"], workshop, choose_places().server) as running,
        pytest.raises(BenchError, match="estimates differ"),
    ):
        check_estimates(running, PLAIN, grid=False, states=2)


def test_who_knows_no_grid_is_not_taken_for_one_who_does(workshop: Path) -> None:
    with (
        started(CONTESTANTS["floor-two"], workshop, choose_places().server) as running,
        pytest.raises(BenchError, match="estimates differ"),
    ):
        check_estimates(running, replace(PLAIN, jitter_s=0.012), grid=True, states=2)


def test_the_floor_follows_several_bodies(workshop: Path) -> None:
    places = choose_places()
    with started(CONTESTANTS["floor"], workshop, places.server) as running:
        track = Track(workshop, places, replace(PLAIN, bodies=4))
        trial = track.run(running, Load(3, warmup_s=0.2, seconds=0.5))
    assert trial.unanswered == 0
    assert trial.failures == ()


def test_a_network_that_the_floor_does_not_know_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "euler.onnx"
    path.write_bytes(model_bytes(NetworkConfig(features="euler")))
    with pytest.raises(BenchError, match="floor knows networks with features rot6d"):
        write_weights(path, tmp_path / "weights")


def test_weights_are_as_many_as_the_floor_reads(tmp_path: Path) -> None:
    write_weights(default_model_path(), tmp_path / "weights")
    one, two, head = (130 + 64 + 1) * 4 * 64, (64 + 128 + 1) * 4 * 128, 12 * (128 + 1)
    values = np.fromfile(tmp_path / "weights", "<f4")
    assert len(values) == 1 + one + two + head
    assert values[0] == np.float32(6.0)  # 2 · 30 Hz · 0.1
