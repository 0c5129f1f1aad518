"""All that is measured of one contestant in one encoding."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from fervor_bench.capacity import MOST_P99_MS, Capacity, Verdict, find_capacity
from fervor_bench.check import check_estimates
from fervor_bench.contestant import Contestant, Running, started
from fervor_bench.machine import Places
from fervor_bench.plan import Plan
from fervor_bench.traffic import Encoding, Traffic
from fervor_bench.trial import Track, Trial

FILL_SHARE = 0.7
"""The search for the capacity begins at this share of what the saturated rate would carry."""

Told = Callable[[str], None]
"""Takes a line about how far a run is."""


@dataclass(frozen=True, slots=True)
class Standing:
    """What was measured; None where it was not asked for or can't be had."""

    contestant: str
    encoding: Encoding
    difference: float | None
    """Largest difference of its estimates from the model's."""
    start_s: float | None
    idle_kib: float | None
    """Resident memory of an idle session, beyond the kernel's socket."""
    saturated: Trial | None
    capacity: Capacity | None
    trials: tuple[Trial, ...]

    @property
    def name(self) -> str:
        """Contestant and encoding."""
        return f"{self.contestant}, {self.encoding}"


def stand(
    contestant: Contestant, traffic: Traffic, plan: Plan, *, folder: Path, places: Places, told: Told
) -> Standing:
    """Start a contestant and measure it.

    Raises:
        BenchError: it can't run here, or its estimates are not the model's.
    """
    told(f"{contestant.name}, {traffic.encoding}: starting")
    with started(contestant, folder, places.server) as running:
        track = Track(folder, places, traffic)
        # Memory first: what earlier sessions gave back would be taken again and not show.
        idle = track.idle_kib(running, plan.idle) if plan.idle else None
        plain = replace(traffic, joints=13, bodies=1, frames_per_message=1, checkpoints=False)
        difference = check_estimates(running, plain)
        measured = measure(running, track, plan, told=told, name=f"{contestant.name}, {traffic.encoding}")
    return replace(measured, contestant=contestant.name, idle_kib=idle, difference=difference)


def measure(running: Running, track: Track, plan: Plan, *, told: Told, name: str) -> Standing:
    """Put all loads of a plan on a service that runs."""
    told(f"{name}: saturated")
    saturated = track.run(running, plan.filled(plan.saturated))
    trials = []
    for sessions in plan.sessions:
        told(f"{name}: {sessions} sessions")
        trials.append(track.run(running, plan.load(sessions)))
    capacity = None
    if plan.most_sessions:
        capacity = _search(running, track, plan, saturated, told=told, name=name)
    return Standing(
        contestant=name,
        encoding=track.traffic.encoding,
        difference=None,
        start_s=running.start_s,
        idle_kib=None,
        saturated=saturated,
        capacity=capacity,
        trials=tuple(trials),
    )


def _search(running: Running, track: Track, plan: Plan, saturated: Trial, *, told: Told, name: str) -> Capacity:
    def judge(sessions: int) -> Verdict:
        told(f"{name}: does it keep {sessions} sessions?")
        trial = track.run(running, replace(plan.load(sessions), loop="open"))
        return Verdict(keeps=trial.keeps(MOST_P99_MS), valid=trial.valid)

    per_session = track.traffic.rate_hz * track.traffic.bodies
    first = int(FILL_SHARE * saturated.frames_per_second / per_session)
    return find_capacity(
        judge, first=first, most=plan.most_sessions, resolution=plan.resolution, attempts=plan.attempts
    )
