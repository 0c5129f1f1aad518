"""One measurement: a load on a running contestant, and what came of it."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fervor_bench.contestant import Running
from fervor_bench.generator import Generator, Load, Seen
from fervor_bench.latency import Latency
from fervor_bench.machine import Places
from fervor_bench.native import build
from fervor_bench.pauses import Window
from fervor_bench.traffic import Traffic
from fervor_bench.usage import busy_seconds, cpu_seconds, resident_kib

VARIANTS, LEAST_VARIANTS = 32, 8
"""Different motions and clocks in one run: so many, or fewer where scripts would get long."""

MOST_PAYLOADS = 100_000
"""In a script, unless that leaves it fewer than `LEAST_VARIANTS`."""

MOST_MESSAGES = 40_000
"""Of one variant: a closed loop may come to their end, which ends its window."""

FASTEST_US = 3.0
"""No service here answers frames faster than this, so a closed loop needs no more messages."""

MOST_LAG_MS = 1.0
"""The generator's own delay (99 % of messages) above which an open loop at random phases does not count."""

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
        return not self.failures and self.latency.p99_ms < most_p99_ms


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

        def note() -> None:
            if running.pid is not None:
                busy = busy_seconds(self.places.server) - (cpu_seconds(beside) if beside else 0.0)
                notes.append((time.monotonic(), self._used(running.pid), busy))

        with self._generator(running, load) as generator:
            generator.wait_until_ready()
            seen = generator.run(note, note)
        if len(notes) < 2:
            return conclude(load, seen, None)
        (begin, server, busy), (end, server_after, busy_after) = notes
        return conclude(load, seen, Used(server_after - server, busy_after - busy, (begin, end)))

    def idle_kib(self, running: Running, sessions: int) -> float:
        """Resident memory that each of so many idle sessions costs a contestant, KiB."""
        assert running.pid is not None
        with self._generator(running, Load(min(sessions, 32))) as generator:
            generator.wait_until_ready()  # what the first sessions make, the others share
        before = resident_kib(running.pid)
        with self._generator(running, Load(sessions)) as generator:
            started = generator.wait_until_ready()
            return (resident_kib(running.pid) - before) / started

    def _generator(self, running: Running, load: Load) -> Generator:
        script = self.folder / "script"
        messages = messages_needed(load, self.traffic)
        self.traffic.write(
            script,
            address=running.address,
            target=running.path,
            variants=min(max(min(VARIANTS, MOST_PAYLOADS // messages), LEAST_VARIANTS), load.sessions),
            messages=messages,
            token=running.token,
        )
        return Generator(
            build("load", self.folder),
            script,
            address=(running.host, running.port),
            load=load,
            settle=messages_to_settle(load, self.traffic),
            processor=self.places.generator,
            result=self.folder / "result",
        )


def messages_to_settle(load: Load, traffic: Traffic) -> int:
    """Messages that one session sends ahead."""
    return math.ceil(load.settle_s * traffic.rate_hz / traffic.pictures_per_turn) * traffic.messages_per_turn


def messages_needed(load: Load, traffic: Traffic) -> int:
    """Messages that one session may send in a run."""
    ahead, seconds = messages_to_settle(load, traffic), load.warmup_s + load.seconds
    if load.loop == "open":
        turns = math.ceil(seconds * traffic.rate_hz / traffic.pictures_per_turn) + 1
        return ahead + turns * traffic.messages_per_turn
    frames = seconds / (FASTEST_US * 1e-6) / load.sessions
    return ahead + min(math.ceil(frames / traffic.frames_per_message) + 1, MOST_MESSAGES)


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
    return told if seen.frames else [*told, "no frame was answered"]


def _objections(load: Load, lag_ms: float, share: float, others: float) -> list[str]:
    told = []
    most_ms = MOST_LOCKSTEP_LAG_MS if load.arrivals == "lockstep" else MOST_LAG_MS
    if lag_ms > most_ms:
        told.append(
            f"the generator lagged: 1 % of its messages left {lag_ms:.1f} ms late or more; expected {most_ms:g}"
        )
    if share > MOST_SHARE and load.loop == "open":  # closed: `generator_share` says who waited for whom
        told.append(f"the generator used {share:.0%} of its processor")
    if others > MOST_OTHERS:
        told.append(f"others used {others:.0%} of the contestant's processor")
    return told
