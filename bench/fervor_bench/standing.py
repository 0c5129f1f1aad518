"""All that is measured of one contestant with one kind of messages."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fervor_bench.capacity import MOST_P99_MS, NEAR_P99_MS, Capacity, Verdict, find_capacity
from fervor_bench.check import check_estimates
from fervor_bench.contestant import PAUSES, Contestant, Running, started
from fervor_bench.generator import Load
from fervor_bench.lone import Lone, measure_lone
from fervor_bench.machine import Places
from fervor_bench.pauses import Pauses, read_pauses
from fervor_bench.plan import Plan
from fervor_bench.traffic import Encoding, Traffic
from fervor_bench.trial import Track, Trial

FILL_SHARE = 0.6
"""The search for the capacity begins at this share of what the saturated rate would carry."""

Told = Callable[[str], None]
"""Takes a line about how far a run is."""


@dataclass(frozen=True, slots=True)
class Standing:
    """What was measured; None where it was not asked for or can't be had."""

    contestant: str
    encoding: Encoding
    frames: int
    """In a message."""
    difference: float | None
    """Largest difference of its estimates from the model's."""
    start_s: float | None
    idle_kib: float | None
    """Resident memory of an idle session, beyond the kernel's socket."""
    lone: Lone | None
    saturated: Trial | None
    capacity: Capacity | None
    confirmed: Trial | None
    """The longest trial of that many sessions."""
    search: tuple[Trial, ...]
    """All trials of the search, in order."""
    trials: tuple[Trial, ...]
    pauses: Pauses | None
    """Of the collector, in all open loops together."""

    @property
    def name(self) -> str:
        """Contestant and messages."""
        several = f", {self.frames} a message" if self.frames > 1 else ""
        return f"{self.contestant}, {self.encoding}{several}"

    @property
    def all_trials(self) -> tuple[Trial, ...]:
        """Everything that is shown."""
        few = (self.saturated, self.confirmed)
        return (*(self.lone.trials if self.lone else ()), *(trial for trial in few if trial), *self.trials)


def stand(
    contestant: Contestant, traffic: Traffic, plan: Plan, *, folder: Path, places: Places, told: Told
) -> Standing:
    """Start a contestant and measure it.

    Raises:
        BenchError: it can't run here, or its estimates are not the model's.
    """
    name = f"{contestant.name}, {traffic.encoding}"
    told(f"{name}: starting")
    with started(contestant, folder, places.server) as running:
        track = Track(folder, places, traffic)
        # Memory first: what earlier sessions gave back would be taken again and not show.
        idle = track.idle_kib(running, plan.idle) if plan.idle and traffic.frames_per_message == 1 else None
        plain = replace(traffic, joints=13, bodies=1, checkpoints=False)
        difference = check_estimates(running, plain, grid=contestant.complete, states=contestant.states)
        measured = measure(running, track, plan, told=told, name=name)
    windows = [trial.window for trial in measured.all_trials if trial.window and trial.load.loop == "open"]
    pauses = read_pauses(folder / PAUSES, windows)
    return replace(measured, contestant=contestant.name, idle_kib=idle, difference=difference, pauses=pauses)


def measure(running: Running, track: Track, plan: Plan, *, told: Told, name: str) -> Standing:
    """Put all loads of a plan on a service that runs."""
    traffic, settled = track.traffic, running.states == 1
    lone = None
    if plan.lone_s and traffic.frames_per_message == traffic.bodies == 1:
        told(f"{name}: a lone session")
        lone = measure_lone(running, track, plan)
    told(f"{name}: saturated")
    saturated = track.run(running, plan.filled(plan.saturated, settled=settled))
    trials = []
    capacity: Capacity | None = None
    search: list[Trial] = []
    with track.keeping(running, max(plan.most_sessions, *plan.sessions, 1)):
        for sessions in plan.sessions:
            told(f"{name}: {sessions} sessions")
            trials.append(track.run(running, plan.load(sessions, settled=settled)))
        if plan.most_sessions:
            capacity, search = _search(running, track, plan, saturated, told=told, name=name)
    return Standing(
        contestant=name,
        encoding=traffic.encoding,
        frames=traffic.frames_per_message,
        difference=None,
        start_s=running.start_s,
        idle_kib=None,
        lone=lone,
        saturated=saturated,
        capacity=capacity,
        confirmed=_last_kept(capacity, search),
        search=tuple(search),
        trials=tuple(trials),
        pauses=None,
    )


def _search(
    running: Running, track: Track, plan: Plan, saturated: Trial, *, told: Told, name: str
) -> tuple[Capacity, list[Trial]]:
    """The capacity, and the trials that found it."""
    trials: list[Trial] = []

    def ask(load: Load) -> Verdict:
        told(f"{name}: does it keep {load.sessions} sessions?")
        trial = track.run(running, load)
        trials.append(trial)
        return Verdict(keeps=trial.keeps(MOST_P99_MS), valid=trial.valid, near=trial.keeps(NEAR_P99_MS))

    settled = running.states == 1
    per_session = track.traffic.rate_hz * track.traffic.bodies
    found = find_capacity(
        lambda sessions: ask(plan.trial(sessions, settled=settled)),
        first=int(FILL_SHARE * saturated.frames_per_second / per_session),
        most=plan.most_sessions,
        resolution=plan.resolution,
        attempts=plan.attempts,
        confirm=(lambda sessions: ask(plan.long_trial(sessions, settled=settled))) if plan.confirm_s else None,
    )
    return found, trials


def _last_kept(capacity: Capacity | None, search: Sequence[Trial]) -> Trial | None:
    """The last trial that kept the capacity."""
    kept = [trial for trial in search if trial.keeps(MOST_P99_MS)]
    return next((trial for trial in reversed(kept) if capacity and trial.load.sessions == capacity.sessions), None)
