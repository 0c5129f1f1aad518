"""One measurement: a load on a running contestant, and what came of it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from fervor_bench.contestant import Running
from fervor_bench.fleet import Fleet
from fervor_bench.generator import Load, Seen
from fervor_bench.latency import Latency
from fervor_bench.machine import Places
from fervor_bench.pauses import Window
from fervor_bench.traffic import Traffic
from fervor_bench.usage import busy_seconds, cpu_seconds, resident_kib

MOST_LAG_MS = {"spin": 1.0, "sleep": 2.0}
"""The generator's own delay (99 % of messages) above which an open loop at random phases does not count.

It is part of the latency. Where a few sessions are answered within a millisecond or two, it would be the figure; where
many have to be answered within 10 ms, it takes a fifth of that at most, and what is kept in spite of it is kept.
"""

MOST_LOCKSTEP_LAG_MS = 10.0
"""Likewise in lockstep, where all is due at once and sending takes its time."""

MOST_SHARE = 0.95
"""The generator's share of its processor above which it may be what limits an open loop."""

MOST_OTHERS = 0.1
"""Share of the contestant's processor that others may use."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What one load did to one contestant."""

    load: Load
    latency: Latency
    frames_per_second: float
    """Answered in the window."""
    server_us: float | None
    """The contestant's processor time a frame, microseconds; None where its process is elsewhere."""
    server_share: float | None
    """Its share of a processor."""
    others_share: float | None
    """What others used of the contestant's processor."""
    generator_share: float
    """Of the other processor, by the load generator."""
    lag_p99_ms: float
    """The generator's delay; part of the latency, since that counts from the schedule."""
    window: Window | None
    """When it was measured; None where the contestant's process is elsewhere."""
    unanswered: int
    checkpoints: int
    lost: bool = False
    """It ended early, since the contestant fell behind; its latencies are those of the part before."""
    took_s: float = 0.0
    """From beginning to end, with what goes ahead of the window."""
    failures: tuple[str, ...] = field(default=())
    """Sessions refused or closed, and errors: what the contestant did not do."""
    objections: tuple[str, ...] = field(default=())
    """Why this does not count: the generator did not keep its schedule, or others used the contestant's processor."""

    @property
    def valid(self) -> bool:
        """Whether the generator kept its schedule, and nobody else was at work."""
        return not self.objections

    def keeps(self, most_p99_ms: float) -> bool:
        """Whether every session was served, 99 % of the frames in time."""
        return not self.failures and not self.lost and self.latency.p99_ms < most_p99_ms


class Used(NamedTuple):
    """Processor time in a window, seconds."""

    server_s: float
    """Of the contestant's process."""
    busy_s: float
    """Of its processor, whoever used it."""
    window: Window


class Track:
    """Where loads run: folder, processors, and the traffic."""

    def __init__(
        self, folder: Path, places: Places, traffic: Traffic, *, used: Callable[[int], float] = cpu_seconds
    ) -> None:
        """Prepare.

        Args:
            folder: for what a run makes.
            places: who runs where.
            traffic: what is sent.
            used: processor time of a contestant by its process, seconds.
        """
        self.folder = folder
        self.places = places
        self.traffic = traffic
        self._used = used
        self._kept: Fleet | None = None

    @contextmanager
    def keeping(self, running: Running, most: int) -> Iterator[None]:
        """Within, open loops of up to `most` sessions on a contestant go on with the sessions of the one before."""
        with self._fleet(running, most) as fleet:
            self._kept = fleet
            try:
                yield
            finally:
                self._kept = None

    def run(self, running: Running, load: Load, *, beside: int | None = None) -> Trial:
        """Put a load on a contestant.

        Args:
            running: the contestant.
            load: what it gets.
            beside: a process that may use its processor too.

        Raises:
            BenchError: no session could be started, or the generator failed.
        """
        notes: list[tuple[float, float, float]] = []
        asked = time.monotonic()

        def note() -> None:
            if running.pid is not None:
                busy = busy_seconds(self.places.server) - (cpu_seconds(beside) if beside else 0.0)
                notes.append((time.monotonic(), self._used(running.pid), busy))

        kept = self._kept if load.loop == "open" else None
        with nullcontext(kept) if kept else self._fleet(running) as fleet:
            seen = fleet.run(load, note, note)
        used = None
        if len(notes) == 2:
            (begin, server, busy), (end, server_after, busy_after) = notes
            used = Used(server_after - server, busy_after - busy, (begin, end))
        return replace(conclude(load, seen, used), took_s=time.monotonic() - asked)

    def idle_kib(self, running: Running, sessions: int) -> float:
        """Resident memory that each of so many idle sessions costs a contestant, KiB."""
        assert running.pid is not None
        with self._fleet(running) as fleet:
            fleet.open(Load(min(sessions, 32)))  # what the first sessions make, the others share
        before = resident_kib(running.pid)
        with self._fleet(running) as fleet:
            started = fleet.open(Load(sessions))
            return (resident_kib(running.pid) - before) / started

    def _fleet(self, running: Running, most: int = 0) -> Fleet:
        return Fleet(self.folder, self.places.generator, self.traffic, running, most=most)


def conclude(load: Load, seen: Seen, used: Used | None) -> Trial:
    """A trial from what the generator saw, and the processor time used meanwhile where that is known."""
    lag_ms = Latency.of(seen.lags).p99_ms if len(seen.lags) else 0.0
    window_s = max(seen.window_s, 1e-9)
    share, others = seen.busy_s / window_s, None
    if used is not None:
        others = max(used.busy_s - used.server_s, 0.0) / window_s
    return Trial(
        load=load,
        latency=Latency.of(seen.latencies, seen.unanswered),
        frames_per_second=seen.frames / window_s,
        server_us=used.server_s / seen.frames * 1e6 if used and seen.frames else None,
        server_share=used.server_s / window_s if used else None,
        others_share=others,
        generator_share=share,
        lag_p99_ms=lag_ms,
        window=used.window if used else None,
        unanswered=seen.unanswered,
        checkpoints=seen.checkpoints,
        lost=seen.lost,
        failures=tuple(_failures(seen)),
        objections=tuple(_objections(load, lag_ms, share, others or 0.0)),
    )


def _failures(seen: Seen) -> list[str]:
    told = [
        f"{count} {what}"
        for count, what in (
            (seen.refused, "sessions refused"),
            (seen.closed, "sessions closed"),
            (seen.errors, f"errors: {seen.first_error}"),
        )
        if count
    ]
    return told if seen.frames or seen.lost else [*told, "no frame was answered"]


def _objections(load: Load, lag_ms: float, share: float, others: float) -> list[str]:
    told = []
    most_ms = MOST_LOCKSTEP_LAG_MS if load.arrivals == "lockstep" else MOST_LAG_MS[load.waits]
    if lag_ms > most_ms:
        told.append(
            f"the generator lagged: 1 % of its messages left {lag_ms:.1f} ms late or more; expected {most_ms:g}"
        )
    if share > MOST_SHARE and load.loop == "open":  # closed: `generator_share` says who waited for whom
        told.append(f"the generator used {share:.0%} of its processor")
    if others > MOST_OTHERS:
        told.append(f"others used {others:.0%} of the contestant's processor")
    return told
