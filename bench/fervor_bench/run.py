"""One run of `fervor bench`: every contestant in turn, on the same two processors."""

import resource
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

from fervor.errors import InputError
from fervor_bench.contestant import CONTESTANTS, Contestant, Running, started
from fervor_bench.errors import BenchError
from fervor_bench.frame_cost import Inside, measure_inside
from fervor_bench.gaps import measure_interruptions
from fervor_bench.generator import Load
from fervor_bench.machine import Places, choose_places, describe_machine
from fervor_bench.plan import SETTLE_S, Plan
from fervor_bench.results import Breakdown, Results
from fervor_bench.scoring import Beside, Rates, measure_beside, measure_rates
from fervor_bench.stages import read_stacks, sampled, share_out
from fervor_bench.standing import Told, measure, stand
from fervor_bench.traffic import Encoding, Traffic
from fervor_bench.trial import Track

PATH = "/v1/stream"

ENCODINGS: tuple[Encoding, ...] = ("json", "msgpack")

LIVE_SESSIONS = 100
"""Beside a client that scores."""


def measure_all(plan: Plan, *, stages: bool, scoring: bool, told: Told) -> Results:
    """Start and measure the plan's contestants; one that can't run here costs no other its place.

    Raises:
        BenchError: nobody could be measured; says why.
    """
    machine, places = describe_machine(), choose_places()
    if plan.look_s:
        told("what the machine takes away")
        machine = replace(machine, interruptions=measure_interruptions((places.server, places.generator), plan.look_s))
    standings, left_out, breakdowns = [], [], []
    insides: Sequence[Inside] = ()
    rates: Rates | None = None
    beside: Beside | None = None
    with _workshop() as folder:
        for contestant, traffic in plan.entries():
            try:
                standings.append(stand(contestant, traffic, plan, folder=folder, places=places, told=told))
                if stages and contestant.complete and traffic.frames_per_message == 1:
                    told(f"{contestant.name}, {traffic.encoding}: stages")
                    breakdowns.append(_break_down(contestant, traffic, plan, folder, places))
            except BenchError as error:
                left_out.append(f"{contestant.name}, {traffic.encoding}: not measured: {error.message}")
        if stages:
            told("inside the service")
            insides = measure_inside(processor=places.server)
        if scoring:
            told("scoring")
            rates, beside = _measure_scoring(plan, folder, places)
    if not standings:
        raise BenchError(left_out[0] if left_out else f"no contestant speaks {plan.encoding}")
    return Results(
        machine=machine,
        plan=plan,
        standings=standings,
        left_out=left_out,
        breakdowns=breakdowns,
        insides=insides,
        rates=rates,
        beside=beside,
    )


def measure_url(url: str, plan: Plan, *, token: str, told: Told) -> Results:
    """Measure a service that runs somewhere, from here.

    Raises:
        BenchError: it can't be reached, or lets no session in.
        InputError: the URL can't be used.
    """
    running = running_at(url, token)
    machine, places = describe_machine(), choose_places()
    standings = []
    with _workshop() as folder:
        for encoding in ENCODINGS:
            if plan.encoding in (encoding, "both"):
                for traffic in plan.traffics(None, encoding):
                    found = measure(running, Track(folder, places, traffic), plan, told=told, name=f"{url}, {encoding}")
                    standings.append(replace(found, contestant=url))
    return Results(machine=machine, plan=plan, standings=standings)


def running_at(url: str, token: str) -> Running:
    """The service behind a URL.

    Raises:
        InputError: it is not ws://HOST[:PORT][/PATH].
    """
    try:
        parts = urlsplit(url)
        port = parts.port or 80
    except ValueError:
        parts, port = urlsplit(""), 0
    if parts.scheme not in ("ws", "http") or not parts.hostname:
        raise InputError(f"{url!r} is not the address of a service; expected ws://HOST:PORT, without TLS")
    return Running(parts.hostname, port, parts.path.rstrip("/") or PATH, token)


def _break_down(contestant: Contestant, traffic: Traffic, plan: Plan, folder: Path, places: Places) -> Breakdown:
    """Sample a contestant while it is saturated."""
    stacks = folder / "stacks"
    stacks.unlink(missing_ok=True)
    with started(contestant, folder, places.server) as running:
        assert running.pid is not None
        track = Track(folder, places, traffic)
        load = plan.filled(plan.saturated, settled=False)
        with sampled(running.pid, stacks):
            trial = track.run(running, replace(load, waits="sleep"))  # the sampler shares the generator's processor
    name = f"{contestant.name}, {traffic.encoding}"
    return Breakdown(name, plan.saturated, trial.server_us or 0.0, tuple(share_out(read_stacks(stacks))))


def _measure_scoring(plan: Plan, folder: Path, places: Places) -> tuple[Rates, Beside]:
    with started(CONTESTANTS["fervor"], folder, places.server) as running:
        rates = measure_rates(running, places.server, plan.seconds)
        track = Track(folder, places, Traffic())
        beside = measure_beside(running, track, Load(LIVE_SESSIONS, seconds=plan.seconds, settle_s=SETTLE_S))
    return rates, beside


@contextmanager
def _workshop() -> Iterator[Path]:
    """A folder for what a run makes, and room for many sockets in those it starts."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    try:
        with tempfile.TemporaryDirectory(prefix="fervor-bench-") as folder:
            yield Path(folder)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
