"""Results as tables for people: absolute figures, and ratios to the naive service and to the floor."""

import math
from collections.abc import Iterator, Sequence

from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from fervor_bench.capacity import MOST_P99_MS, Capacity
from fervor_bench.results import Breakdown, Results
from fervor_bench.scoring import ALONE, Beside, Rates
from fervor_bench.standing import Standing
from fervor_bench.trial import Trial

NONE = "-"

TRIAL = ("sessions", "p50", "p99", "p99.9", "frames/s", "processor", "generator", "lag p99", "")
"""Headings of `_trial_cells`; times in ms, shares of the contestant's and the generator's processor."""

NAIVE = ("naive", "naive-tuned")
"""What ratios are taken to: the first of them that was measured."""


def show(console: Console, results: Results) -> None:
    """Print everything."""
    console.print(results.machine.sentence, highlight=False, soft_wrap=True)
    console.print(Group(*_tables(results)))
    for sentence in (*results.left_out, *_remarks(results.standings)):
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)


def _tables(results: Results) -> Iterator[Table | Text]:
    yield _costs(results.standings)
    if any(standing.capacity for standing in results.standings):
        yield _capacities(results.standings)
    if any(standing.trials for standing in results.standings):
        yield _latencies(results)
    for breakdown in results.breakdowns:
        yield _stages(breakdown)
    if results.rates:
        yield _rates(results.rates)
    if results.beside:
        yield _beside(results.beside)


def _costs(standings: Sequence[Standing]) -> Table:
    headings = (
        "processor time, µs",
        "x naive",
        "of floor",
        "frames/s",
        "generator",
        "idle session, KiB",
        "ready after, s",
    )
    table = _table("a frame, saturated", "contestant", *headings)
    naive, floor = _yardsticks(standings)
    for standing in standings:
        cost, saturated = _cost(standing), standing.saturated
        table.add_row(
            standing.name,
            _number(cost),
            _ratio(_cost(naive), cost),
            _share(_cost(floor), cost),
            _number(saturated.frames_per_second, 0) if saturated else NONE,
            _percent(saturated.generator_share) if saturated else NONE,
            _number(standing.idle_kib),
            _number(standing.start_s, 2),
        )
    return table


def _capacities(standings: Sequence[Standing]) -> Table:
    title = f"most sessions, 99 % within {MOST_P99_MS:g} ms"
    table = _table(title, "contestant", "sessions", "x naive", "of floor")
    naive, floor = (_sessions(standing) for standing in _yardsticks(standings))
    for standing in standings:
        sessions = _sessions(standing)
        table.add_row(standing.name, _counted(standing.capacity), _ratio(sessions, naive), _share(sessions, floor))
    return table


def _yardsticks(standings: Sequence[Standing]) -> tuple[Standing | None, Standing | None]:
    """The naive service and the floor, as far as they were measured."""
    by_name = {standing.contestant: standing for standing in standings}
    return next((by_name[name] for name in NAIVE if name in by_name), None), by_name.get("floor")


def _latencies(results: Results) -> Table:
    how = f"{results.plan.loop} loop"
    if results.plan.loop == "open":
        how += f", {results.plan.arrivals} arrivals, {results.plan.traffic.rate_hz:g} Hz"
    table = _table(f"latency, ms, by number of sessions ({how})", "contestant", *TRIAL)
    for standing in results.standings:
        for trial in standing.trials:
            table.add_row(standing.name, *_trial_cells(trial))
    return table


def _trial_cells(trial: Trial) -> tuple[str, ...]:
    return (
        f"{trial.load.sessions}",
        _number(trial.latency.p50_ms, 2),
        _number(trial.latency.p99_ms, 2),
        _number(trial.latency.p999_ms, 2),
        _number(trial.frames_per_second, 0),
        _percent(trial.server_share),
        _percent(trial.generator_share),
        _number(trial.lag_p99_ms, 2),
        "failed" if trial.failures else "" if trial.valid else "not valid",
    )


def _stages(breakdown: Breakdown) -> Table:
    title = f"stages of a frame: {breakdown.name}, {breakdown.sessions} sessions, {breakdown.server_us:.1f} µs"
    table = _table(title, "stage", "share", "µs")
    for stage in breakdown.stages:
        table.add_row(stage.name, f"{stage.share:.0%}", f"{stage.share * breakdown.server_us:.1f}")
    return table


def _rates(rates: Rates) -> Table:
    headings = ("sequences", "frames each", "processor time, µs a frame", "x model alone", "frames/s")
    table = _table("scoring over HTTP, one processor, two states", "body", *headings)
    for rate in rates.kinds:
        table.add_row(
            rate.kind,
            f"{rate.sequences}",
            f"{rate.frames}",
            _number(rate.server_us),
            _ratio(rate.server_us, rates.model_us),
            f"{rate.frames_per_second:,.0f}",
        )
    rows, steps = ALONE
    table.add_row("model alone, one state", f"{rows}", f"{steps}", _number(rates.model_us), "1.0", NONE)
    return table


def _beside(beside: Beside) -> Table:
    title = f"latency, ms, of live sessions beside a client that scores without pause ({beside.requests} requests)"
    table = _table(title, "", *TRIAL)
    table.add_row("alone", *_trial_cells(beside.alone))
    table.add_row("beside scoring", *_trial_cells(beside.beside))
    return table


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left")
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left", no_wrap=not number)
    return table


def _remarks(standings: Sequence[Standing]) -> Iterator[str]:
    """Why some figures do not count."""
    for standing in standings:
        filled = () if standing.saturated is None else (standing.saturated,)
        for trial in (*filled, *standing.trials):
            for remark in (*trial.failures, *trial.objections):
                yield f"{standing.name}, {trial.load.sessions} sessions, {trial.load.loop} loop: {remark}"
        if standing.capacity and not standing.capacity.bounded:
            yield f"{standing.name}: may carry more sessions than shown; the search ended without a sound failure"


# --- cells ------------------------------------------------------------------------------------------------------------


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
