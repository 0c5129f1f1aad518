"""What operators watch, for Prometheus.

Counts of frames and bytes are read from the sessions when somebody asks, so that counting costs a frame nothing; only
batches, refusals and ends are noted as they happen. Nothing here names a client or a body.
"""

import asyncio
from collections.abc import Iterable
from dataclasses import asdict

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from fervor import __version__
from fervor.engine.batcher import Batcher, Run
from fervor.model import Model
from fervor.server.board import Board
from fervor.server.connections import Connections
from fervor.server.draining import Drain
from fervor.server.gathered import Gathered
from fervor.server.scoring_process import ScoringProcess

LAG_EVERY_S = 0.5
"""How often the event loop's lag is looked at."""

_SECONDS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0)
_LONG_SECONDS = (0.01, 0.05, 0.1, 0.5, 1.0, 5.0, 10.0, 60.0)
_SIZES = (1, 2, 4, 8, 16, 32, 64, 128, 256)

_TOTALS = {
    "frames": "frames taken",
    "estimates": "estimates given",
    "late": "frames that came too late",
    "duplicate": "frames that came again",
    "rejected": "frames refused",
    "resets": "bodies that started anew",
}

_TRAFFIC = {
    "gaps": ("gaps", "frames that came after a gap"),
    "bytes_in": ("received_bytes", "bytes of messages from clients"),
    "bytes_out": ("sent_bytes", "bytes of messages to clients"),
    "checkpoints": ("checkpoints", "checkpoints given"),
    "checkpoint_bytes": ("checkpoint_bytes", "bytes of checkpoints given"),
    "resumed": ("bodies_resumed", "bodies that went on from a checkpoint"),
    "superseded": ("superseded", "messages that a newer one replaced before a slow reader took them"),
}


class Metrics:
    """The metrics of one service."""

    def __init__(
        self, model: Model, batcher: Batcher, *, drain: Drain, connections: Connections, scoring: ScoringProcess
    ) -> None:
        self.registry = registry = CollectorRegistry()
        registry.register(_Live(model, batcher, drain, connections, scoring))
        ProcessCollector(registry=registry)
        self._size = Histogram("fervor_batch_size", "tickets run together", buckets=_SIZES, registry=registry)
        self._run = Histogram("fervor_run_seconds", "one run of the model", buckets=_SECONDS, registry=registry)
        self._wait = Histogram(
            "fervor_wait_seconds", "longest wait of a ticket in a run", buckets=_SECONDS, registry=registry
        )
        self._lag = Histogram("fervor_loop_lag_seconds", "delay of the event loop", buckets=_SECONDS, registry=registry)
        self._score = Histogram("fervor_score_seconds", "one scoring job", buckets=_LONG_SECONDS, registry=registry)
        by_reason = ("reason",)
        self._refused = Counter("fervor_sessions_refused", "sessions not let in", by_reason, registry=registry)
        self._ended = Counter("fervor_sessions_ended", "sessions that are over", by_reason, registry=registry)
        self._gathered: Gathered | None = None
        batcher.watch(self._note_run)
        scoring.watch(self._score.observe)

    @property
    def shown(self) -> Collector:
        """What `/metrics` shows: with several workers, those of all."""
        return self._gathered or self.registry

    def gather(self, board: Board, place: int) -> None:
        """Share these metrics with the other workers."""
        self._gathered = Gathered(self.registry, board, place)
        self._gathered.show()

    def note_refusal(self, reason: str) -> None:
        """A session was not let in."""
        self._refused.labels(reason).inc()

    def note_end(self, reason: str) -> None:
        """A session is over."""
        self._ended.labels(reason).inc()

    async def watch_loop(self) -> None:
        """Look at the event loop's lag, and tell the other workers how things stand, for ever."""
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + LAG_EVERY_S
            await asyncio.sleep(LAG_EVERY_S)
            self._lag.observe(max(loop.time() - due, 0.0))
            if self._gathered is not None:
                self._gathered.show()

    def _note_run(self, run: Run) -> None:
        self._size.observe(run.size)
        self._run.observe(run.seconds)
        self._wait.observe(run.waited)


class _Live(Collector):
    """What is read from the service as it stands."""

    def __init__(
        self, model: Model, batcher: Batcher, drain: Drain, connections: Connections, scoring: ScoringProcess
    ) -> None:
        self._model = model
        self._batcher = batcher
        self._drain = drain
        self._connections = connections
        self._scoring = scoring

    def collect(self) -> Iterable[Metric]:
        yield self._build()
        yield from self._gauges()
        yield CounterMetricFamily("fervor_sessions", "sessions begun", value=self._drain.begun)
        yield CounterMetricFamily("fervor_connections_refused", "connections cut", value=self._connections.refused)
        yield CounterMetricFamily("fervor_scores_refused", "scoring requests refused", value=self._scoring.refused)
        totals = self._drain.all_totals().model_dump()
        for name, what in _TOTALS.items():
            yield CounterMetricFamily(f"fervor_{name}", what, value=totals[name])
        traffic = asdict(self._drain.all_traffic())
        for field, (name, what) in _TRAFFIC.items():
            yield CounterMetricFamily(f"fervor_{name}", what, value=traffic[field])

    def _gauges(self) -> Iterable[Metric]:
        slots = self._batcher.engine.slots
        yield GaugeMetricFamily("fervor_connections", "connections open", value=self._connections.open)
        yield GaugeMetricFamily("fervor_sessions", "sessions open", value=len(self._drain.talking))
        yield GaugeMetricFamily("fervor_bodies", "bodies followed, the probe's included", value=slots.taken)
        yield GaugeMetricFamily("fervor_bodies_capacity", "bodies that can be followed", value=slots.capacity)
        yield GaugeMetricFamily("fervor_queue", "tickets that wait", value=self._batcher.depth)
        yield GaugeMetricFamily("fervor_score_queue", "scoring requests under way", value=self._scoring.waiting)

    def _build(self) -> Metric:
        known = self._model.metadata
        labels = {
            "version": __version__,
            "model": known.name,
            "model_version": known.version,
            "purpose": known.purpose,
            "sha256": self._model.sha256,
            "fingerprint": self._model.fingerprint,
        }
        info = GaugeMetricFamily("fervor_build_info", "what runs here; always 1", labels=list(labels))
        info.add_metric(list(labels.values()), 1.0)
        return info
