"""One robot alone: within how many milliseconds it is answered, and where they go.

At 30 Hz a lone session's service sleeps between frames, so a frame waits for the machine to wake it up, and finds cold
caches. The same load on a processor that something else keeps awake leaves the caches; a closed loop leaves the work.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from fervor_bench.contestant import Running
from fervor_bench.machine import pinned
from fervor_bench.plan import Plan
from fervor_bench.trial import Track, Trial


@dataclass(frozen=True, slots=True)
class Lone:
    """One session, three ways."""

    asleep: Trial
    """By schedule."""
    awake: Trial | None
    """By schedule, its processor kept awake; None for a service elsewhere."""
    closed: Trial
    """The next frame when the last is answered."""

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All of them."""
        return (self.asleep, self.closed) if self.awake is None else (self.asleep, self.awake, self.closed)


def measure_lone(running: Running, track: Track, plan: Plan) -> Lone:
    """Measure one session."""
    settled = running.states == 1
    load = replace(plan.load(1, seconds=plan.lone_s, settled=settled), loop="open")
    asleep, awake = track.run(running, load), None
    if running.pid is not None:
        with kept_awake(track.places.server) as keeper:
            awake = track.run(running, load, beside=keeper)
    return Lone(asleep, awake, track.run(running, plan.filled(1, settled=settled)))


@contextmanager
def kept_awake(processor: int) -> Iterator[int]:
    """Something that always runs on a processor while nothing else wants to; gives its process."""
    with pinned(processor):
        process = subprocess.Popen([sys.executable, "-I", "-S", "-c", "while True: pass"])
    try:
        os.sched_setscheduler(process.pid, os.SCHED_IDLE, os.sched_param(0))
        yield process.pid
    finally:
        process.kill()
        process.wait()
