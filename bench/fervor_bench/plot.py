"""Results as one picture: latency by number of sessions, and the cost of a frame."""

import math
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fervor_bench.capacity import MOST_P99_MS
from fervor_bench.results import Results


def plot(results: Results, path: Path) -> None:
    """Draw to a file; its name says the format."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    latency, cost = figure.subplots(1, 2, width_ratios=(3, 2))
    _latencies(latency, results)
    _costs(cost, results)
    figure.suptitle(results.machine.sentence, fontsize=7)
    figure.savefig(path, dpi=150)


def _latencies(axes: Axes, results: Results) -> None:
    for standing in results.standings:
        seen = [trial for trial in (*standing.trials, *standing.search) if not trial.lost]
        points = sorted(
            (trial.load.sessions, trial.latency.p99_ms) for trial in seen if math.isfinite(trial.latency.p99_ms)
        )
        if points:
            axes.plot([at for at, _ in points], [p99 for _, p99 in points], marker="o", label=standing.name)
    axes.axhline(MOST_P99_MS, color="grey", linestyle="--", linewidth=1)
    axes.set(xscale="log", yscale="log", xlabel="sessions", ylabel="ms within which 99 % of the frames are answered")
    axes.set_title(f"{results.plan.loop} loop, {results.plan.arrivals} arrivals, {results.plan.traffic.rate_hz:g} Hz")
    if axes.lines[1:]:
        axes.legend()


def _costs(axes: Axes, results: Results) -> None:
    bars = [
        (standing.name, standing.saturated.server_us)
        for standing in results.standings
        if standing.saturated and standing.saturated.server_us
    ]
    places = range(len(bars))
    axes.barh(list(places), [cost for _, cost in bars])
    axes.set_yticks(list(places), [name for name, _ in bars])
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="µs of processor time a frame, saturated")
    axes.set_xlim(left=1.0)
