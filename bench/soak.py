"""Keeps a service busy with clients of every kind, and fails if it grows: `make soak SECONDS=600`.

    python -m bench.soak [--seconds 600] [--clients 8]

A real service process is churned: sessions that end well or are torn off, bodies that come and go, resumes, garbage,
clients that read nothing, scores. Meanwhile its memory, file descriptors, sessions and bodies are printed. At the end
all clients leave, and then

- sessions and bodies must be those before the first client, exactly, and file descriptors no more than then;
- memory must not have grown by more than `MOST_GROWTH` a minute, by a straight line through what was measured after the
  warm-up (the first third).
"""

import argparse
import asyncio
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import httpx
import numpy as np
from rich.console import Console
from rich.table import Table

from bench.soak_clients import KINDS, Churn
from bench.soak_service import Served, serve

WARM_UP = 1 / 3
"""Share of the time after which memory is looked at: allocators, caches and buffers have their size by then."""

MOST_GROWTH = 4.0
"""MiB a minute. A leak of one session's smallest object (1 kB) is 8 MiB a minute at the churn of a quick machine."""

MOST_NOISE = 16.0
"""MiB that memory may move by in a short run, in which a slope says little."""

OWN_BODIES = 1
"""The probe's."""

SAMPLES = 60
SETTLE_S = 30.0


@dataclass(frozen=True, slots=True)
class Sample:
    """What the service held at one instant."""

    at: float  # seconds since the start
    memory: float  # MiB resident
    descriptors: int
    sessions: int
    bodies: int


def growth(samples: Sequence[Sample]) -> float:
    """MiB a minute, by least squares over what comes after the warm-up."""
    late = [sample for sample in samples if sample.at >= WARM_UP * samples[-1].at]
    slope, _ = np.polyfit([sample.at for sample in late], [sample.memory for sample in late], 1)
    return float(slope * 60.0)


def leftovers(before: Sample, after: Sample) -> list[str]:
    """What the service still holds after all clients have gone, one sentence each."""
    found = []
    if after.descriptors > before.descriptors:
        found.append(f"{after.descriptors} file descriptors are open at rest; there were {before.descriptors}")
    for what in ("sessions", "bodies"):
        left, were = getattr(after, what), getattr(before, what)
        if left != were:
            found.append(f"{left} {what} are left after all clients have gone; expected {were}")
    return found


def swellings(samples: Sequence[Sample]) -> list[str]:
    """Whether memory grows, in a sentence if it does."""
    minutes = (1.0 - WARM_UP) * samples[-1].at / 60.0
    rate = growth(samples)
    if rate <= MOST_GROWTH or rate * minutes <= MOST_NOISE:
        return []
    return [f"memory grows by {rate:.2f} MiB a minute; expected at most {MOST_GROWTH:g}"]


async def measure(served: Served, http: httpx.AsyncClient, began: float) -> Sample:
    """What the service holds now."""
    answer = await http.get(f"{served.url}/metrics")
    answer.raise_for_status()
    numbers = {
        line.split()[0]: float(line.split()[-1]) for line in answer.text.splitlines() if line[:1] not in ("", "#")
    }
    return Sample(
        at=asyncio.get_running_loop().time() - began,
        memory=served.memory,
        descriptors=served.descriptors,
        sessions=int(numbers["fervor_sessions"]),
        bodies=int(numbers["fervor_bodies"]),
    )


async def at_rest(served: Served, http: httpx.AsyncClient, before: Sample, began: float) -> Sample:
    """What is left once everything had the time to end."""
    until = asyncio.get_running_loop().time() + SETTLE_S
    while True:
        sample = await measure(served, http, began)
        if not leftovers(before, sample) or asyncio.get_running_loop().time() > until:
            return sample
        await asyncio.sleep(0.5)


async def soak(seconds: float, clients: int, console: Console) -> list[str]:
    """Churn, watch, and say what is wrong."""
    table = Table(title="a service under churn")
    for heading in ("s", "MiB", "descriptors", "sessions", "bodies", "conversations"):
        table.add_column(heading, justify="right")
    async with (
        serve() as served,
        httpx.AsyncClient(timeout=60.0, limits=httpx.Limits(max_keepalive_connections=0)) as http,
    ):
        done: Counter[str] = Counter()
        await Churn(served.address, seed=0, done=Counter()).each()  # so that what is made once is made: the scorer, say
        began = asyncio.get_running_loop().time()
        first = await measure(served, http, began)
        before = await at_rest(served, http, replace(first, sessions=0, bodies=OWN_BODIES), began)
        crowd = [asyncio.create_task(Churn(served.address, seed=n, done=done).run()) for n in range(1, clients + 1)]
        samples = []
        try:
            for number in range(1, SAMPLES + 1):
                await asyncio.sleep(max(began + number * seconds / SAMPLES - asyncio.get_running_loop().time(), 0.0))
                samples.append(await measure(served, http, began))
                if number % max(SAMPLES // 15, 1) == 0:
                    _note(table, samples[-1], done)
        finally:
            for task in crowd:
                task.cancel()
            ends = await asyncio.gather(*crowd, return_exceptions=True)
        after = await at_rest(served, http, before, began)
        _note(table, after, done)
    console.print(table)
    kinds = ", ".join(f"{kind} {done[kind]}" for kind in KINDS)
    console.print(f"{sum(done.values())} conversations: {kinds}; memory {growth(samples):+.2f} MiB a minute")
    failed = [f"a client failed: {end!r}" for end in ends if not isinstance(end, asyncio.CancelledError)]
    missing = [f"no conversation of the kind {kind!r} took place" for kind in KINDS if not done[kind]]
    return failed + missing + swellings(samples) + leftovers(before, after)


def _note(table: Table, sample: Sample, done: Counter[str]) -> None:
    table.add_row(
        f"{sample.at:.0f}",
        f"{sample.memory:.1f}",
        f"{sample.descriptors}",
        f"{sample.sessions}",
        f"{sample.bodies}",
        f"{sum(done.values())}",
    )


def main() -> None:
    """Parse the options and run; exit 1 with what is wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--clients", type=int, default=8)
    options = parser.parse_args()
    found = asyncio.run(soak(options.seconds, options.clients, Console()))
    sys.exit("\n".join(found) or None)


if __name__ == "__main__":
    main()
