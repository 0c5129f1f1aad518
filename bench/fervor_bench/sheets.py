"""Results as sheets: absolute figures, and ratios to the naive service and to the floors; shown by who likes to."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fervor_bench.capacity import MOST_P99_MS, Capacity
from fervor_bench.frame_cost import STAGES, Inside
from fervor_bench.results import Breakdown, Results
from fervor_bench.scoring import ALONE, Beside, Rates
from fervor_bench.standing import Standing
from fervor_bench.trial import Trial

NONE = "-"

NAIVE = ("naive", "naive-tuned")
"""What ratios are taken to: the first of them that was measured."""

FLOORS = ("floor", "floor-two")

TRIAL = ("sessions", "p50", "p99", "p99.9", "frames/s", "processor", "generator", "lag p99", "")
"""Headings of `_trial_cells`; times in ms, shares of the contestant's and the generator's processor."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """One table; its first column names, the others are figures."""

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


def sheets(results: Results) -> Iterator[Sheet]:
    """All that there is something to say in."""
    standings = results.standings
    yield _costs(results)
    if any(standing.capacity for standing in standings):
        yield _capacities(results)
        yield _searches(standings)
    if any(standing.lone for standing in standings):
        yield _lone(results)
    if any(standing.trials for standing in standings):
        yield _latencies(results)
    if any(standing.pauses for standing in standings):
        yield _pauses(standings)
    yield from map(_stages, results.breakdowns)
    if results.insides:
        yield inside(results.insides)
    if results.rates:
        yield _rates(results.rates)
    if results.beside:
        yield _beside(results.beside)


def remarks(results: Results) -> Iterator[str]:
    """Who was left out, and why some figures do not count."""
    yield from results.left_out
    for standing in results.standings:
        for trial in standing.all_trials:
            for remark in (*trial.failures, *trial.objections):
                yield f"{standing.name}, {trial.load.sessions} sessions, {trial.load.loop} loop: {remark}"
        if standing.capacity and not standing.capacity.bounded:
            yield f"{standing.name}: may carry more sessions than shown; the search ended without a sound failure"


def _costs(results: Results) -> Sheet:
    headings = (
        "contestant",
        "µs a frame",
        "x naive",
        *(f"of {name}" for name in FLOORS),
        "frames/s",
        "generator",
        "idle, KiB",
        "ready, s",
    )
    rows = [
        (
            standing.name,
            _number(cost),
            _ratio(_cost(_naive(results.standings)), cost),
            *(_share(_cost(floor), cost) for floor in _floors(results.standings, standing)),
            _number(saturated.frames_per_second, 0) if saturated else NONE,
            _percent(saturated.generator_share) if saturated else NONE,
            _number(standing.idle_kib),
            _number(standing.start_s, 2),
        )
        for standing in results.standings
        for cost, saturated in [(_cost(standing), standing.saturated)]
    ]
    return Sheet(
        f"processor time of a frame, saturated: {results.plan.saturated} sessions, closed loop", headings, rows
    )


def _capacities(results: Results) -> Sheet:
    floors = [f"of {name}" for name in FLOORS]
    headings = ("contestant", "sessions", "x naive", *floors, "p50", "p99", "p99.9", "processor")
    rows = [
        (
            standing.name,
            _counted(standing.capacity),
            _ratio(_sessions(standing), _sessions(_naive(results.standings))),
            *(_share(_sessions(standing), _sessions(floor)) for floor in _floors(results.standings, standing)),
            *(_latency_cells(standing.confirmed) if standing.confirmed else (NONE,) * 3),
            _percent(standing.confirmed.server_share) if standing.confirmed else NONE,
        )
        for standing in results.standings
    ]
    how = f"{results.plan.traffic.rate_hz:g} Hz, {results.plan.arrivals} arrivals"
    return Sheet(
        f"most sessions of which 99 % of the frames are answered within {MOST_P99_MS:g} ms ({how})", headings, rows
    )


def _searches(standings: Sequence[Standing]) -> Sheet:
    rows = [
        (standing.name, ", ".join(map(_step, standing.search)), f"{sum(trial.took_s for trial in standing.search):.0f}")
        for standing in standings
        if standing.search
    ]
    title = "how that was found: sessions tried one after the other, and their p99, ms"
    return Sheet(title, ("contestant", "trials", "took, s"), rows)


def _lone(results: Results) -> Sheet:
    headings = (
        "contestant",
        *("p50", "p99", "p99.9", "x floor", "lag p99"),
        *("awake p50", "awake p99"),
        *("closed p50", "closed p99", "closed x floor", ""),
    )
    lones = [(standing, standing.lone) for standing in results.standings if standing.lone]
    floor = next((lone for standing, lone in lones if standing.contestant == "floor"), None)
    rows = [
        (
            standing.name,
            *_latency_cells(lone.asleep),
            _ratio(lone.asleep.latency.p50_ms, floor.asleep.latency.p50_ms if floor else None),
            _number(lone.asleep.lag_p99_ms, 3),
            *(_latency_cells(lone.awake)[:2] if lone.awake else (NONE, NONE)),
            *_latency_cells(lone.closed, digits=3)[:2],
            _ratio(lone.closed.latency.p50_ms, floor.closed.latency.p50_ms if floor else None),
            _verdict(lone.asleep),
        )
        for standing, lone in lones
    ]
    rate = f"{results.plan.traffic.rate_hz:g} Hz"
    return Sheet(f"a lone session, ms: at {rate}; at {rate} on a processor kept awake; closed loop", headings, rows)


def _latencies(results: Results) -> Sheet:
    how = f"{results.plan.loop} loop"
    if results.plan.loop == "open":
        how += f", {results.plan.arrivals} arrivals, {results.plan.traffic.rate_hz:g} Hz"
    rows = [(standing.name, *_trial_cells(trial)) for standing in results.standings for trial in standing.trials]
    return Sheet(f"latency, ms, by number of sessions ({how})", ("contestant", *TRIAL), rows)


def _pauses(standings: Sequence[Standing]) -> Sheet:
    rows = [
        (standing.name, f"{told.young}", f"{told.older}", _number(told.longest_ms, 2), f"{told.share:.2%}")
        for standing in standings
        if (told := standing.pauses)
    ]
    title = "pauses of the garbage collector in all open loops"
    return Sheet(title, ("contestant", "young", "older", "longest, ms", "of the time"), rows)


def _stages(breakdown: Breakdown) -> Sheet:
    title = f"stages of a frame: {breakdown.name}, {breakdown.sessions} sessions, {breakdown.server_us:.1f} µs"
    rows = [
        (stage.name, f"{stage.share:.0%}", f"{stage.share * breakdown.server_us:.1f}") for stage in breakdown.stages
    ]
    return Sheet(title, ("stage", "share", "µs"), rows)


def inside(costs: Sequence[Inside]) -> Sheet:
    """Stages by bodies."""
    rows = [
        (
            f"{cost.encoding}, {cost.bodies} together",
            *(_number(cost.stages_us[stage]) for stage in STAGES),
            _number(cost.frame_us),
            _ratio(costs[0].frame_us, cost.frame_us),
        )
        for cost in costs
    ]
    title = "a frame inside the service, µs, without sockets; engine without the model"
    return Sheet(title, ("bodies", *STAGES, "frame", "gain over the first"), rows)


def _rates(rates: Rates) -> Sheet:
    headings = ("body", "sequences", "frames each", "µs a frame", "x model alone", "frames/s")
    rows = [
        (
            rate.kind,
            f"{rate.sequences}",
            f"{rate.frames}",
            _number(rate.server_us),
            _ratio(rate.server_us, rates.model_us),
            f"{rate.frames_per_second:,.0f}",
        )
        for rate in rates.kinds
    ]
    rows.append(("model alone, one state", f"{ALONE[0]}", f"{ALONE[1]}", _number(rates.model_us), "1.0", NONE))
    return Sheet("scoring over HTTP: processor time, one processor, two states", headings, rows)


def _beside(beside: Beside) -> Sheet:
    title = f"latency, ms, of live sessions beside a client that scores without pause ({beside.requests} requests)"
    rows = [("alone", *_trial_cells(beside.alone)), ("beside scoring", *_trial_cells(beside.beside))]
    return Sheet(title, ("live sessions", *TRIAL), rows)


# --- yardsticks -------------------------------------------------------------------------------------------------------


def _naive(standings: Sequence[Standing]) -> Standing | None:
    """The naive service, as far as it was measured."""
    by_name = {standing.contestant: standing for standing in standings}
    return next((by_name[name] for name in NAIVE if name in by_name), None)


def _floors(standings: Sequence[Standing], beside: Standing) -> Iterator[Standing | None]:
    """Each floor, with as many frames a message as `beside` has, as far as it was measured."""
    for name in FLOORS:
        yield next((each for each in standings if (each.contestant, each.frames) == (name, beside.frames)), None)


# --- cells ------------------------------------------------------------------------------------------------------------


def _trial_cells(trial: Trial) -> tuple[str, ...]:
    return (
        f"{trial.load.sessions}",
        *_latency_cells(trial),
        _number(trial.frames_per_second, 0),
        _percent(trial.server_share),
        _percent(trial.generator_share),
        _number(trial.lag_p99_ms, 2),
        _verdict(trial),
    )


def _step(trial: Trial) -> str:
    """A trial of a search: what was asked, and what came of it."""
    kept = "kept" if trial.keeps(MOST_P99_MS) else "lost" if trial.lost else "not kept"
    p99 = "" if trial.lost else f" {_number(trial.latency.p99_ms)}"
    doubt = "" if trial.valid else ", not valid"
    return f"{trial.load.sessions} for {trial.load.seconds:g} s:{p99} {kept}{doubt}"


def _latency_cells(trial: Trial, digits: int = 2) -> tuple[str, str, str]:
    latency = trial.latency
    return _number(latency.p50_ms, digits), _number(latency.p99_ms, digits), _number(latency.p999_ms, digits)


def _verdict(trial: Trial) -> str:
    if trial.failures or trial.lost:
        return "failed" if trial.failures else "lost"
    return "" if trial.valid else "not valid"


def _cost(standing: Standing | None) -> float | None:
    return standing.saturated.server_us if standing and standing.saturated else None


def _sessions(standing: Standing | None) -> float | None:
    return float(standing.capacity.sessions) if standing and standing.capacity else None


def _counted(capacity: Capacity | None) -> str:
    if capacity is None:
        return NONE
    return f"{capacity.sessions}" if capacity.bounded else f"≥ {capacity.sessions}"


def _number(value: float | None, digits: int = 1) -> str:
    if value is None:
        return NONE
    return f"{value:,.{digits}f}" if math.isfinite(value) else "never"


def _percent(value: float | None) -> str:
    return NONE if value is None else f"{value:.0%}"


def _ratio(value: float | None, base: float | None) -> str:
    return f"{value / base:.1f}" if value is not None and base else NONE


def _share(value: float | None, base: float | None) -> str:
    return f"{value / base:.0%}" if value is not None and base else NONE
