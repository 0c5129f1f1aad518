"""Everything one process of the service holds, made once at start and handed to whoever needs it."""

from dataclasses import dataclass
from pathlib import Path

from starlette.requests import HTTPConnection

from fervor.engine.batcher import Batcher
from fervor.engine.engine import Engine
from fervor.model import Model, check_row_independence, default_model_path
from fervor.server.backlog import Backlog
from fervor.server.connections import Connections
from fervor.server.draining import Drain
from fervor.server.kept_skeletons import load_skeletons
from fervor.server.metrics import Metrics
from fervor.server.model_info import model_info
from fervor.server.origins import Origins
from fervor.server.probe import Probe
from fervor.server.scoring_process import Allowed, ScoringProcess, Start
from fervor.server.sealing import seal_and_open
from fervor.server.sessions import Sessions
from fervor.server.shedding import Shedding
from fervor.server.tokens import Tokens
from fervor.server.tracing import Tracing
from fervor.server.turn import Turn
from fervor.server.watchers import Watchers
from fervor.session.host import Host
from fervor.session.spread import Spread
from fervor.settings import Settings

OWN_BODIES = 1
"""Bodies the service keeps for itself, beside its capacity: the probe's, so that a full service can still be probed."""


@dataclass(frozen=True, slots=True)
class Service:
    """The parts of a running service."""

    settings: Settings
    model: Model
    batcher: Batcher
    turn: Turn
    host: Host
    tokens: Tokens
    page_tokens: Tokens
    origins: Origins
    connections: Connections
    sessions: Sessions
    backlog: Backlog
    shedding: Shedding
    drain: Drain
    metrics: Metrics
    probe: Probe
    scoring: ScoringProcess
    tracing: Tracing
    watchers: Watchers

    @classmethod
    def open(cls, settings: Settings) -> "Service":
        """Load the model and prove that it can be batched; takes about a second.

        Raises:
            ModelFileError: a model file whose contract the service can't meet.
            SettingsError: a file that the settings name can't be used.
            EngineError: a model whose results depend on the batch in a way that no padding mends.
        """
        path = settings.model or default_model_path()
        model = Model.load(path)
        multiple = check_row_independence(model)
        engine = Engine(model, capacity=settings.capacity + OWN_BODIES, row_multiple=multiple)
        batcher = Batcher(engine)
        turn = Turn(batcher)
        drain, connections = Drain(), Connections(settings.max_connections)
        shedding = Shedding(batcher, most_delay_s=settings.max_queue_delay_s)
        scoring = _scoring(settings, path, model, multiple)
        metrics = Metrics(model, batcher, drain=drain, connections=connections, scoring=scoring)
        slots = engine.slots
        tokens = Tokens.from_settings(settings)
        return cls(
            settings=settings,
            model=model,
            batcher=batcher,
            turn=turn,
            host=_host(settings, model, batcher),
            tokens=tokens,
            page_tokens=Tokens.of_watchers(settings, tokens),
            origins=Origins(settings.origins),
            connections=connections,
            sessions=Sessions(settings, slots=slots, drain=drain, shedding=shedding, metrics=metrics),
            backlog=Backlog(batcher, turn, most=settings.max_queue),
            shedding=shedding,
            drain=drain,
            metrics=metrics,
            probe=Probe(batcher),
            scoring=scoring,
            tracing=Tracing.from_environment(),
            watchers=Watchers(settings.max_watchers),
        )


def _host(settings: Settings, model: Model, batcher: Batcher) -> Host:
    """What sessions know of the service."""
    seal, unseal = seal_and_open(settings)
    spread = Spread()
    batcher.watch(lambda _: spread.begin())  # a turn ends with its run
    return Host(
        model=model_info(model),
        metadata=model.metadata,
        limits=settings.limits,
        fingerprint=model.fingerprint,
        claim=batcher.engine.claim,
        seal=seal,
        unseal=unseal,
        spread=spread,
        skeletons=load_skeletons(settings.skeletons),
    )


def _scoring(settings: Settings, path: Path, model: Model, row_multiple: int) -> ScoringProcess:
    """The scoring process, not yet started."""
    start = Start(
        model=path,
        sha256=model.sha256,
        row_multiple=row_multiple,
        skeletons=settings.skeletons,
        allowed=Allowed(frames=settings.score_max_frames, sequences=settings.score_max_sequences),
        logs=(settings.log_format, settings.log_level),
    )
    return ScoringProcess(start, most_waiting=settings.score_queue, timeout_s=settings.score_timeout_s)


def service_of(connection: HTTPConnection) -> Service:
    """The service that a request or a WebSocket came to."""
    service = connection.app.state.service
    assert isinstance(service, Service)
    return service
