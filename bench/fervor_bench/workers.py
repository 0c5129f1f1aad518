"""What a second worker is worth, on a machine that has no processor left for it: all share one processor.

Workers share nothing but the listening socket. So how many sessions they carry on processors of their own follows from
two figures that can be taken on one: what a frame costs beside other workers, and how evenly the sessions fall to them.
"""

import re
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from http.client import HTTPConnection
from pathlib import Path

from rich.table import Table

from fervor_bench.contestant import CONTESTANTS, Contestant, Running, started
from fervor_bench.errors import BenchError
from fervor_bench.generator import Load
from fervor_bench.machine import choose_places
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track
from fervor_bench.usage import family_cpu_seconds

WORKERS = (1, 2)

SESSIONS = 128

READY_S = 60.0
"""Longest wait for all workers."""

_BY_WORKER = re.compile(r"^fervor_sessions_total(?:\{[^}]*\})? (\S+)$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Crew:
    """Some workers, measured together."""

    workers: int
    frame_us: float
    """Processor time a frame, all processes, microseconds."""
    sessions: tuple[int, ...]
    """That fell to each worker."""

    @property
    def evenness(self) -> float:
        """Sessions of the mean worker, as a share of the busiest one's."""
        return sum(self.sessions) / self.workers / max(self.sessions)

    def gain(self, alone: "Crew") -> float:
        """Sessions that they carry, as a multiple of what one worker carries: each on a processor of its own."""
        return self.workers * self.evenness * alone.frame_us / self.frame_us


def worker_gains(seconds: float = 2.0) -> Table:
    """Measure, and show as a table."""
    table = Table(title="workers, each on a processor of its own: worked out from one they share")
    for heading in ("workers", "µs a frame", "busiest worker has", "x sessions of one"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory(prefix="fervor-bench-") as folder:
        crews = measure_crews(Path(folder), seconds)
    for crew in crews:
        busiest = max(crew.sessions) / sum(crew.sessions)
        table.add_row(f"{crew.workers}", f"{crew.frame_us:.1f}", f"{busiest:.0%}", f"{crew.gain(crews[0]):.2f}")
    return table


def measure_crews(folder: Path, seconds: float, sessions: int = SESSIONS) -> Sequence[Crew]:
    """Fill one worker and then several with the same closed loop.

    Raises:
        BenchError: they can't be started, or no session was let in.
    """
    places = choose_places()
    crews = []
    for workers in WORKERS:
        with started(_with_workers(workers), folder, places.server) as running:
            _wait_for(running, workers)
            track = Track(folder, places, Traffic(), used=family_cpu_seconds)
            trial = track.run(running, Load(sessions, "closed", warmup_s=seconds / 4, seconds=seconds))
            if trial.server_us is None:
                raise BenchError(f"{workers} workers answered no frame")
            crews.append(Crew(workers, trial.server_us, tuple(_sessions(running))))
    return crews


def _with_workers(workers: int) -> Contestant:
    fervor = CONTESTANTS["fervor"]
    return replace(fervor, command=lambda folder, port: [*fervor.command(folder, port), "--workers", str(workers)])


def _wait_for(running: Running, workers: int) -> None:
    """Until all workers serve."""
    until = time.monotonic() + READY_S
    while len(_sessions(running)) < workers:
        if time.monotonic() > until:
            raise BenchError(f"{workers} workers were not ready after {READY_S:g} s")
        time.sleep(0.05)


def _sessions(running: Running) -> list[int]:
    """Sessions that began, by worker."""
    connection = HTTPConnection(running.host, running.port, timeout=10.0)
    try:
        connection.request("GET", "/metrics")
        text = connection.getresponse().read().decode()
    finally:
        connection.close()
    return [int(float(count)) for count in _BY_WORKER.findall(text)]
