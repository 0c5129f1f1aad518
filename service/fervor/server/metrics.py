"""What operators watch, for Prometheus.

Counts of frames are read from the sessions when somebody asks, so that counting costs a frame nothing; only batches and
refusals are noted as they happen. Nothing here names a client or a body.
"""

import asyncio
from collections import Counter as Tally
from collections.abc import Iterable, Iterator

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from fervor.engine.batcher import Batcher, Run
from fervor.protocol.messages import Totals
from fervor.server.draining import Drain

LAG_EVERY_S = 0.5
"""How often the event loop's lag is looked at."""

_SECONDS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0)
_SIZES = (1, 2, 4, 8, 16, 32, 64, 128, 256)

_TOTALS = {
    "frames": "frames taken",
    "estimates": "estimates given",
    "late": "frames that came too late",
    "duplicate": "frames that came again",
    "rejected": "frames refused",
    "resets": "bodies that started anew",
}


class Metrics:
    """The metrics of one service."""

    def __init__(self, batcher: Batcher, drain: Drain) -> None:
        self.registry = CollectorRegistry()
        self.registry.register(_Live(batcher, drain))
        self._size = Histogram("fervor_batch_size", "tickets run together", buckets=_SIZES, registry=self.registry)
        self._run = Histogram("fervor_run_seconds", "one run of the model", buckets=_SECONDS, registry=self.registry)
        self._wait = Histogram(
            "fervor_wait_seconds", "longest wait of a ticket in a run", buckets=_SECONDS, registry=self.registry
        )
        self._lag = Histogram(
            "fervor_loop_lag_seconds", "delay of the event loop", buckets=_SECONDS, registry=self.registry
        )
        self._refused = Counter(
            "fervor_sessions_refused", "sessions not let in", labelnames=("reason",), registry=self.registry
        )
        batcher.watch(self._note_run)

    def note_refusal(self, reason: str) -> None:
        """A session was not let in."""
        self._refused.labels(reason).inc()

    async def watch_loop(self) -> None:
        """Look at the event loop's lag, for ever."""
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + LAG_EVERY_S
            await asyncio.sleep(LAG_EVERY_S)
            self._lag.observe(max(loop.time() - due, 0.0))

    def _note_run(self, run: Run) -> None:
        self._size.observe(run.size)
        self._run.observe(run.seconds)
        self._wait.observe(run.waited)


class _Live(Collector):
    """What is read from the service as it stands."""

    def __init__(self, batcher: Batcher, drain: Drain) -> None:
        self._batcher = batcher
        self._drain = drain

    def collect(self) -> Iterable[Metric]:
        slots = self._batcher.engine.slots
        yield GaugeMetricFamily("fervor_sessions", "sessions open", value=len(self._drain.talking))
        yield GaugeMetricFamily("fervor_bodies", "bodies followed, the probe's included", value=slots.taken)
        yield GaugeMetricFamily("fervor_bodies_capacity", "bodies that can be followed", value=slots.capacity)
        yield GaugeMetricFamily("fervor_queue", "tickets that wait", value=self._batcher.depth)
        yield CounterMetricFamily("fervor_sessions", "sessions begun", value=self._drain.begun)
        totals = _sum(self._drain.all_totals())
        for name, what in _TOTALS.items():
            yield CounterMetricFamily(f"fervor_{name}", what, value=totals[name])


def _sum(totals: Iterator[Totals]) -> Tally[str]:
    whole: Tally[str] = Tally()
    for one in totals:
        whole.update(one.model_dump())
    return whole
