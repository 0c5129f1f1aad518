"""Where a frame's time goes between the sockets."""

import pytest

from fervor.skeletons.catalog import SKELETONS
from fervor_bench import frame_cost


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_cost, "CROWDS", (("msgpack", 1), ("msgpack", 3), ("json", 2)))
    monkeypatch.setattr(frame_cost, "AHEAD", 3)
    monkeypatch.setattr(frame_cost, "FRAMES", 3)
    monkeypatch.setattr(frame_cost, "ROUNDS", 2)


def test_every_stage_of_every_crowd_takes_its_share() -> None:
    costs = frame_cost.measure_inside()
    assert [(cost.encoding, cost.bodies) for cost in costs] == [("msgpack", 1), ("msgpack", 3), ("json", 2)]
    for cost in costs:
        assert tuple(cost.stages_us) == frame_cost.STAGES
        assert min(cost.stages_us.values()) > 0.0
        assert cost.frame_us == pytest.approx(sum(cost.stages_us.values()))


def test_a_stage_within_another_is_not_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 5.0, 7.0, 7.0, 8.0])  # outer begins, inner begins, inner ends, outer ends; another
    monkeypatch.setattr("fervor_bench.frame_cost.time.perf_counter", lambda: next(clock))
    watch = frame_cost._Watch()
    with watch.on("outer"), watch.on("inner"):
        pass
    with watch.on("outer"):
        pass
    assert watch.spent == {"inner": 4.0, "outer": 4.0}


def test_costs_are_told_for_all_skeletons() -> None:
    assert frame_cost.adapting_costs().row_count == len(SKELETONS)
