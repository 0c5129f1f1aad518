"""Figures and ratios stand where they belong; no figure is shown that does not count without a word."""

from dataclasses import replace

import pytest

from fervor_bench.capacity import Capacity
from fervor_bench.frame_cost import STAGES, Inside
from fervor_bench.generator import Load
from fervor_bench.latency import Latency
from fervor_bench.lone import Lone
from fervor_bench.machine import describe_machine
from fervor_bench.pauses import Pauses
from fervor_bench.plan import Plan
from fervor_bench.results import Breakdown, Results
from fervor_bench.sheets import Sheet, remarks, sheets
from fervor_bench.stages import Stage
from fervor_bench.standing import Standing
from fervor_bench.trial import Trial


def trial(sessions: int = 64, *, us: float | None = 50.0, p50: float = 1.0, **changes) -> Trial:
    made = Trial(
        load=Load(sessions),
        latency=Latency(p50, 2 * p50, 3 * p50, 4 * p50),
        frames_per_second=1000.0,
        server_us=us,
        server_share=0.5,
        others_share=0.0,
        generator_share=0.1,
        lag_p99_ms=0.002,
        window=(0.0, 1.0),
        unanswered=0,
        checkpoints=0,
    )
    return replace(made, **changes)


def standing(name: str, us: float, sessions: int, *, frames: int = 1, p50: float = 1.0) -> Standing:
    return Standing(
        contestant=name,
        encoding="msgpack",
        frames=frames,
        difference=0.0,
        start_s=1.0,
        idle_kib=20.0,
        lone=Lone(trial(1, p50=p50), trial(1, p50=p50 / 2), trial(1, p50=p50 / 4)) if frames == 1 else None,
        saturated=trial(us=us),
        capacity=Capacity(sessions, bounded=True),
        confirmed=trial(sessions),
        search=(
            trial(sessions, p50=4.0, took_s=2.6),
            trial(2 * sessions, lost=True, took_s=1.5),
            trial(sessions + 50, p50=7.0, objections=("the generator lagged",), took_s=2.6),
        ),
        trials=(trial(100),),
        pauses=Pauses(10, 2, 1.5, 0.001) if name == "fervor" else None,
    )


RESULTS = Results(
    machine=describe_machine(),
    plan=Plan(),
    standings=[
        standing("naive", 200.0, 100, p50=4.0),
        standing("fervor", 40.0, 500),
        standing("fervor", 30.0, 800, frames=6),
        standing("floor", 10.0, 2000, p50=0.5),
        standing("floor", 6.0, 4000, frames=6),
        standing("floor-two", 20.0, 1000, p50=0.5),
    ],
    breakdowns=[Breakdown("fervor, msgpack", 64, 40.0, (Stage("model", 0.25),))],
    insides=[Inside("msgpack", bodies, dict.fromkeys(STAGES, 8.0 / bodies)) for bodies in (1, 8)],
)


def sheet(beginning: str, results: Results = RESULTS) -> Sheet:
    (found,) = (each for each in sheets(results) if each.title.startswith(beginning))
    return found


def cell(found: Sheet, row: str, heading: str) -> str:
    (cells,) = (each for each in found.rows if each[0] == row)
    return cells[found.headings.index(heading)]


def test_every_row_has_a_cell_for_every_heading() -> None:
    for found in sheets(RESULTS):
        assert len(set(found.headings)) == len(found.headings)
        assert all(len(row) == len(found.headings) for row in found.rows)


@pytest.mark.parametrize(
    ("row", "naive", "floor", "two"),
    [
        ("naive, msgpack", "1.0", "5%", "10%"),
        ("fervor, msgpack", "5.0", "25%", "50%"),
        ("fervor, msgpack, 6 a message", "6.7", "20%", "-"),  # beside the floor with as many frames
        ("floor, msgpack", "20.0", "100%", "200%"),
    ],
)
def test_costs_stand_beside_the_naive_service_and_both_floors(row: str, naive: str, floor: str, two: str) -> None:
    found = sheet("processor time of a frame")
    assert (cell(found, row, "x naive"), cell(found, row, "of floor"), cell(found, row, "of floor-two")) == (
        naive,
        floor,
        two,
    )


def test_capacities_have_their_latencies() -> None:
    found = sheet("most sessions")
    assert cell(found, "fervor, msgpack", "sessions") == "500"
    assert cell(found, "fervor, msgpack", "x naive") == "5.0"
    assert cell(found, "fervor, msgpack", "of floor") == "25%"
    assert cell(found, "fervor, msgpack", "of floor-two") == "50%"
    assert cell(found, "fervor, msgpack", "p99.9") == "3.00"


def test_a_capacity_says_how_it_was_found() -> None:
    found = sheet("how that was found")
    assert cell(found, "fervor, msgpack", "trials") == (
        "500 for 5 s: 8.0 kept, 1000 for 5 s: lost, 550 for 5 s: 14.0 not kept, not valid"
    )
    assert cell(found, "fervor, msgpack", "took, s") == "7"


def test_a_lone_session_is_a_multiple_of_the_floors() -> None:
    found = sheet("a lone session")
    assert [cell(found, "fervor, msgpack", name) for name in ("p50", "awake p50", "closed p50", "x floor")] == [
        "1.00",
        "0.50",
        "0.250",
        "2.0",
    ]


def test_stages_and_pauses_are_told() -> None:
    assert cell(sheet("stages of a frame"), "model", "µs") == "10.0"
    assert cell(sheet("pauses"), "fervor, msgpack", "longest, ms") == "1.50"
    inside = sheet("a frame inside")
    assert cell(inside, "msgpack, 8 together", "frame") == "6.0"
    assert cell(inside, "msgpack, 8 together", "gain over the first") == "8.0"


def test_what_does_not_count_is_told() -> None:
    bad = trial(7, objections=("the generator lagged",))
    lacking = replace(
        standing("fervor", 40.0, 500),
        lone=Lone(bad, None, trial(1)),
        trials=(trial(9, failures=("9 sessions closed",)),),
        capacity=Capacity(500, bounded=False),
    )
    results = replace(RESULTS, standings=[lacking], left_out=["floor: no C compiler"])
    told = list(remarks(results))
    assert told[0] == "floor: no C compiler"
    assert "fervor, msgpack, 7 sessions, open loop: the generator lagged" in told
    assert "fervor, msgpack, 9 sessions, open loop: 9 sessions closed" in told
    assert any("may carry more" in sentence for sentence in told)
    assert cell(sheet("a lone session", results), "fervor, msgpack", "") == "not valid"
    assert cell(sheet("most sessions", results), "fervor, msgpack", "sessions") == "≥ 500"
    assert cell(sheet("latency", results), "fervor, msgpack", "") == "failed"
    behind = replace(results, standings=[replace(lacking, trials=(trial(9, lost=True),))])
    assert cell(sheet("latency", behind), "fervor, msgpack", "") == "lost"
