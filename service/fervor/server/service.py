"""Everything one process of the service holds, made once at start and handed to whoever needs it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from starlette.requests import HTTPConnection

from fervor.engine.batcher import Batcher
from fervor.engine.engine import Engine
from fervor.errors import Overloaded
from fervor.model import Model, check_row_independence, default_model_path
from fervor.server.draining import Drain
from fervor.server.kept_skeletons import load_skeletons
from fervor.server.metrics import Metrics
from fervor.server.model_info import model_info
from fervor.server.probe import Probe
from fervor.server.scoring_process import Allowed, ScoringProcess, Start
from fervor.server.sealing import seal_and_open
from fervor.session.session import Host
from fervor.settings import Settings

OWN_BODIES = 1
"""Bodies the service keeps for itself, beside its capacity: the probe's, so that a full service can still be probed."""

COME_BACK_S = 1.0
"""What a client that found the service full is told to wait, seconds."""


class Sessions:
    """How many WebSocket sessions are open."""

    open = 0


@dataclass(frozen=True, slots=True)
class Service:
    """The parts of a running service."""

    settings: Settings
    model: Model
    batcher: Batcher
    host: Host
    sessions: Sessions
    drain: Drain
    metrics: Metrics
    probe: Probe
    scoring: ScoringProcess

    @classmethod
    def open(cls, settings: Settings) -> "Service":
        """Load the model and prove that it can be batched; takes about a second.

        Raises:
            ModelFileError: a model file whose contract the service can't meet.
            EngineError: a model whose results depend on the batch in a way that no padding mends.
        """
        path = settings.model or default_model_path()
        model = Model.load(path)
        multiple = check_row_independence(model)
        engine = Engine(model, capacity=settings.capacity + OWN_BODIES, row_multiple=multiple)
        batcher = Batcher(engine)
        drain = Drain()
        seal, unseal = seal_and_open(settings)
        host = Host(
            model=model_info(model),
            metadata=model.metadata,
            limits=settings.limits,
            fingerprint=model.fingerprint,
            claim=engine.claim,
            seal=seal,
            unseal=unseal,
            skeletons=load_skeletons(settings.skeletons),
        )
        return cls(
            settings=settings,
            model=model,
            batcher=batcher,
            host=host,
            sessions=Sessions(),
            drain=drain,
            metrics=Metrics(batcher, drain),
            probe=Probe(batcher),
            scoring=ScoringProcess(
                Start(
                    model=path,
                    sha256=model.sha256,
                    row_multiple=multiple,
                    skeletons=settings.skeletons,
                    allowed=Allowed(frames=settings.score_max_frames, sequences=settings.score_max_sequences),
                ),
                most_waiting=settings.score_queue,
            ),
        )

    @contextmanager
    def admitted(self) -> Iterator[None]:
        """Room for one more session, while it lasts.

        Raises:
            Overloaded: the service stops, has as many sessions as it takes, or no body left to follow.
        """
        slots = self.batcher.engine.slots
        if self.drain.started:
            raise self._refusal("draining", "this service is on its way out; connect again")
        if self.sessions.open >= self.settings.max_sessions:
            raise self._refusal("sessions", f"all {self.sessions.open} sessions of this service are open")
        if slots.taken >= slots.capacity:
            raise self._refusal("bodies", f"all {self.settings.capacity} bodies of this service are in use")
        self.sessions.open += 1
        try:
            yield
        finally:
            self.sessions.open -= 1

    def _refusal(self, reason: str, sentence: str) -> Overloaded:
        self.metrics.note_refusal(reason)
        return Overloaded(sentence, retry_after=COME_BACK_S)


def service_of(connection: HTTPConnection) -> Service:
    """The service that a request or a WebSocket came to."""
    service = connection.app.state.service
    assert isinstance(service, Service)
    return service
