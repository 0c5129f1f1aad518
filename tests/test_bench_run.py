"""Whole runs, as short as they can be: what is printed, written and refused. No figure is judged."""

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from fervor.errors import InputError
from fervor_bench.errors import BenchError
from fervor_bench.machine import Places, choose_places
from fervor_bench.plan import QUICK, Plan
from fervor_bench.plot import plot
from fervor_bench.report import show
from fervor_bench.run import measure_all, measure_url, running_at
from fervor_bench.traffic import Traffic
from program import fervor

TINY = Plan(
    contestants=("naive-tuned", "fervor", "floor"),
    encoding="msgpack",
    frames=(1,),
    sessions=(2, 3),
    seconds=0.4,
    lone_s=0.4,
    saturated=2,
    idle=4,
    most_sessions=2,
    search_s=0.4,
    attempts=1,
    confirm_s=0.5,
    look_s=0.2,
)


def quiet(_: str) -> None:
    """Progress is for people."""


def shown(results) -> str:
    console = Console(width=140, record=True, file=io.StringIO())
    show(console, results)
    return console.export_text()


def test_service_and_floor_are_measured_side_by_side(workshop: Path, tmp_path: Path) -> None:
    results = measure_all(TINY, stages=False, scoring=False, told=quiet)
    assert [standing.name for standing in results.standings] == ["fervor, msgpack", "floor, msgpack"]
    for standing in results.standings:
        assert standing.difference is not None
        assert standing.difference <= 1e-4
        assert standing.idle_kib is not None
        assert standing.saturated is not None
        assert standing.saturated.frames_per_second > 0
        assert [trial.load.sessions for trial in standing.trials] == [2, 3]
        assert standing.lone is not None
        assert standing.lone.awake is not None
        assert standing.capacity is not None
        assert (standing.confirmed is None) == (standing.capacity.sessions == 0)
        assert standing.confirmed is None or standing.confirmed in standing.search
        assert standing.search[0].load.sessions in (1, 2)
        assert all(trial.took_s > trial.load.seconds for trial in standing.search if not trial.lost)
        assert all(not trial.failures for trial in standing.trials)
    service, floor = results.standings
    assert service.pauses is not None
    assert floor.pauses is None  # it has no collector
    text = shown(results)
    for word in (
        "fervor, msgpack",
        "floor, msgpack",
        "x naive",
        "of floor",
        "most sessions",
        "how that was found",
        "With 2 processors busy",
        "a lone session",
        "pauses",
    ):
        assert word in text
    results.write(tmp_path / "results.json")
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["machine"]["interruptions"]["processors"] == 2
    assert [trial["load"]["sessions"] for trial in written["standings"][0]["search"]]
    assert written["plan"]["sessions"] == [2, 3]
    assert written["standings"][1]["contestant"] == "floor"
    plot(results, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_stages_and_scoring_are_measured_too(workshop: Path) -> None:
    plan = replace(TINY, contestants=("fervor",), seconds=1.0, sessions=(), lone_s=0, idle=0, most_sessions=0)
    results = measure_all(plan, stages=True, scoring=True, told=quiet)
    (breakdown,) = results.breakdowns
    assert sum(stage.share for stage in breakdown.stages) == pytest.approx(1.0)
    found = {stage.name: stage.share for stage in breakdown.stages}
    assert {"engine", "model", "session", "conversation"} <= set(found)
    assert [cost.bodies for cost in results.insides] == [1, 8, 64, 256, 64]
    assert results.beside is not None
    text = shown(results)
    assert "stages of a frame" in text
    assert "beside scoring" in text


def test_a_running_service_is_measured_from_outside(live, workshop: Path) -> None:
    results = measure_url(f"ws://{live.address}", TINY, token="", told=quiet)
    (standing,) = results.standings
    assert standing.contestant == f"ws://{live.address}"
    assert standing.saturated is not None
    assert standing.saturated.server_us is None
    assert "ws://" in shown(results)


def test_a_service_with_a_token_wants_it(start_service, workshop: Path) -> None:
    live = start_service(tokens="let-me-in-please")
    with pytest.raises(BenchError, match=r"401|403"):
        measure_url(f"ws://{live.address}", TINY, token="", told=quiet)
    results = measure_url(f"ws://{live.address}", TINY, token="let-me-in-please", told=quiet)
    assert not results.standings[0].trials[0].failures


def test_who_can_not_run_here_costs_no_other_its_place(workshop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise BenchError("no C compiler")

    monkeypatch.setattr("fervor_bench.weights.write_weights", refuse)
    plan = Plan(
        contestants=("fervor", "floor"),
        encoding="msgpack",
        frames=(1,),
        sessions=(1,),
        seconds=0.3,
        lone_s=0,
        idle=0,
        most_sessions=0,
        look_s=0,
    )
    results = measure_all(plan, stages=False, scoring=False, told=quiet)
    assert [standing.contestant for standing in results.standings] == ["fervor"]
    assert results.left_out == ["floor, msgpack: not measured: no C compiler"]
    assert "not measured" in shown(results)


def test_nobody_left_to_measure_is_an_error() -> None:
    plan = Plan(contestants=("naive",), encoding="msgpack")
    with pytest.raises(BenchError, match="no contestant speaks msgpack"):
        measure_all(plan, stages=False, scoring=False, told=quiet)


def test_a_contestant_that_is_not_known_is_refused() -> None:
    with pytest.raises(BenchError, match="contestant fast is not known; expected some of naive, naive-tuned, fervor"):
        Plan(contestants=("fast",))


def test_a_simple_contestant_takes_simple_traffic() -> None:
    for plan in (Plan(contestants=("naive",), traffic=Traffic(joints=25)), Plan(contestants=("naive",), frames=(4,))):
        with pytest.raises(BenchError, match="naive takes 13 joints and one frame a message"):
            plan.entries()
    entries = Plan(contestants=("naive", "fervor", "floor")).entries()
    assert [
        (contestant.name, traffic.encoding, traffic.frames_per_message, traffic.checkpoints)
        for contestant, traffic in entries
    ] == [
        ("naive", "json", 1, False),
        ("fervor", "json", 1, True),
        ("fervor", "json", 6, True),
        ("fervor", "msgpack", 1, True),
        ("fervor", "msgpack", 6, True),
        ("floor", "msgpack", 1, False),
        ("floor", "msgpack", 6, False),
    ]


def test_the_quick_plan_has_service_naive_and_floor() -> None:
    assert {contestant.name for contestant, _ in QUICK.entries()} == {"naive-tuned", "fervor", "floor"}


def test_whoever_keeps_two_states_is_measured_with_both() -> None:
    plan = Plan()
    assert plan.load(5, settled=False).settle_s > 4.0  # the second state begins
    assert plan.filled(5, settled=False).settle_s > 4.0
    assert plan.load(5, settled=True).settle_s == 0.0


def test_the_generator_polls_for_a_lone_session_and_in_closed_loops() -> None:
    plan = Plan()
    assert plan.load(1, settled=True).waits == plan.trial(1, settled=True).waits == "spin"
    assert plan.load(2, settled=True).waits == plan.trial(500, settled=True).waits == "sleep"
    for load in (plan.filled(64, settled=True), replace(plan, loop="closed").load(64, settled=True)):
        assert (load.loop, load.waits) == ("closed", "spin")
    trial = replace(plan, loop="closed").trial(500, settled=True)
    assert (trial.loop, trial.waits) == ("open", "sleep")


@pytest.mark.parametrize("url", ["wss://robot.local", "robot.local:80", "ws://", "ws://robot.local:port"])
def test_an_address_that_can_not_be_used_is_refused(url: str) -> None:
    with pytest.raises(InputError, match="expected ws://HOST:PORT"):
        running_at(url, "")


def test_addresses_have_the_streams_path_unless_they_say_otherwise() -> None:
    assert running_at("ws://robot.local:8080", "").url == "ws://robot.local:8080/v1/stream"
    assert running_at("ws://robot.local/live/v1/stream", "").url == "ws://robot.local:80/live/v1/stream"


def test_one_processor_is_not_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {3})
    with pytest.raises(BenchError, match="need a processor each"):
        choose_places()
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 3, 7})
    assert choose_places() == Places(server=7, generator=3)


def test_the_command_prints_and_writes(workshop: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    said = fervor(
        *("bench", "--contestants", "floor", "--sessions", "2", "--seconds", "0.3", "--frames", "1,6"),
        *("--lone", "0", "--idle", "0", "--most-sessions", "0", "--out", out),
    )
    assert said.returncode == 0, said.stderr
    assert "floor, msgpack" in said.stdout
    assert {path.name for path in out.iterdir()} == {"results.md", "results.json", "plot.png"}
    assert "| floor, msgpack, 6 a message |" in (out / "results.md").read_text()


def test_numbers_that_are_none_are_refused() -> None:
    for option, most in (("--sessions", 20000), ("--frames", 1024)):
        said = fervor("bench", option, "1,many")
        assert said.returncode == 2
        assert f"expected numbers from 1 to {most}" in said.stderr
