"""What a second worker is worth, on a machine that has no processor left for the load.

Workers share nothing but the listening socket. So how many sessions they carry follows from two figures that can be
taken where one of them shares its processor with the load generator: what a frame costs, in processor time, and how
evenly the sessions fall to them: all are carried in time for as long as the busiest worker is not full.
"""

import os
import re
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from http.client import HTTPConnection
from itertools import cycle
from operator import sub
from pathlib import Path

from rich.table import Table

from fervor_bench.contestant import CONTESTANTS, Contestant, Running, started
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.machine import Places, choose_places
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track
from fervor_bench.usage import children, family_cpu_seconds

WORKERS = (1, 2)

SESSIONS = 600
"""About what a worker carries."""

ROUNDS = 3

READY_S = 60.0
"""Longest wait for all workers."""

SETTLE_S = 2.0
"""Longest wait for the metrics of all workers, which are half a second old at most."""

_BY_WORKER = re.compile(r"^fervor_sessions_total(?:\{[^}]*\})? (\S+)$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Crew:
    """Some workers, measured together."""

    workers: int
    frame_us: float
    """Processor time a frame, all processes, microseconds."""
    rounds: tuple[tuple[int, ...], ...]
    """Sessions that fell to each worker, by round."""

    @property
    def evenness(self) -> float:
        """Sessions of the mean worker, as a share of the busiest one's, in the least even round."""
        return min(sum(sessions) / self.workers / max(sessions) for sessions in self.rounds)

    @property
    def lay(self) -> str:
        """How the sessions of the least even round lay."""
        return " + ".join(map(str, max(self.rounds, key=max)))

    def gain(self, alone: "Crew") -> float:
        """Sessions that they carry, as a multiple of what one worker carries: each on a processor of its own."""
        return self.workers * self.evenness * alone.frame_us / self.frame_us


def worker_gains(seconds: float = 2.0) -> Table:
    """Measure, and show as a table."""
    table = Table(title="what workers carry, by what a frame costs them and how sessions fall to them")
    for heading in ("workers", "µs a frame", "sessions lay, at worst", "evenness", "x sessions of one"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory(prefix="fervor-bench-") as folder:
        crews = measure_crews(Path(folder), seconds)
    for crew in crews:
        gain = f"{crew.gain(crews[0]):.2f}"
        table.add_row(f"{crew.workers}", f"{crew.frame_us:.1f}", crew.lay, f"{crew.evenness:.1%}", gain)
    return table


def measure_crews(folder: Path, seconds: float, *, sessions: int = SESSIONS, rounds: int = ROUNDS) -> Sequence[Crew]:
    """Fill one worker and then several with the same closed loop, in turn; the least cost of each counts.

    Raises:
        BenchError: they can't be started, or no session was let in.
    """
    places = choose_places()
    costs: dict[int, list[float]] = {workers: [] for workers in WORKERS}
    lay: dict[int, list[tuple[int, ...]]] = {workers: [] for workers in WORKERS}
    with ExitStack() as stack:
        crews = {workers: stack.enter_context(started(_crew(workers), folder, places.server)) for workers in WORKERS}
        for workers, running in crews.items():
            _wait_for(running, workers)
            _spread(running, places)
        track = Track(folder, places, Traffic(), used=family_cpu_seconds)
        for _ in range(rounds):
            for workers, running in crews.items():
                before = _sessions(running)
                trial = track.run(running, Load(sessions, "closed", warmup_s=seconds / 4, seconds=seconds))
                if trial.server_us is None:
                    raise BenchError(f"{workers} workers answered no frame")
                costs[workers].append(trial.server_us)
                after = _settled(running, sum(before) + sessions)
                lay[workers].append(tuple(map(sub, after, before)))
        return [Crew(workers, min(costs[workers]), tuple(lay[workers])) for workers in WORKERS]


def _crew(workers: int) -> Contestant:
    fervor = CONTESTANTS["fervor"]
    return replace(fervor, command=lambda folder, port: [*fervor.command(folder, port), "--workers", str(workers)])


def _spread(running: Running, places: Places) -> None:
    """Give workers a processor each; one shares the load generator's, which its own time does not show."""
    assert running.pid is not None
    for worker, processor in zip(children(running.pid), cycle((places.server, places.generator)), strict=False):
        os.sched_setaffinity(worker, {processor})


def _wait_for(running: Running, workers: int) -> None:
    """Until all workers serve."""
    until = time.monotonic() + READY_S
    while len(_sessions(running)) < workers:
        if time.monotonic() > until:
            raise BenchError(f"{workers} workers were not ready after {READY_S:g} s")
        time.sleep(0.05)


def _settled(running: Running, expected: int) -> list[int]:
    """Sessions that began, by worker, once so many did; sooner where some were refused."""
    until = time.monotonic() + SETTLE_S
    while sum(found := _sessions(running)) < expected and time.monotonic() < until:
        time.sleep(0.05)
    return found


def _sessions(running: Running) -> list[int]:
    """Sessions that began, by worker."""
    connection = HTTPConnection(running.host, running.port, timeout=10.0)
    try:
        connection.request("GET", "/metrics")
        text = connection.getresponse().read().decode()
    finally:
        connection.close()
    return [int(float(count)) for count in _BY_WORKER.findall(text)]
