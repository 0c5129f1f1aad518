"""Everything one process of the service holds, made once at start and handed to whoever needs it."""

from dataclasses import dataclass

from starlette.requests import HTTPConnection

from fervor.engine.batcher import Batcher
from fervor.engine.engine import Engine
from fervor.errors import Overloaded
from fervor.model import Model, check_row_independence, default_model_path
from fervor.server.kept_skeletons import load_skeletons
from fervor.server.model_info import model_info
from fervor.server.probe import Probe
from fervor.server.scoring_process import Allowed, ScoringProcess, Start
from fervor.session.session import Host
from fervor.settings import Settings

OWN_BODIES = 1
"""Bodies the service keeps for itself, beside its capacity: the probe's, so that a full service can still be probed."""

COME_BACK_S = 1.0
"""What a client that found the service full is told to wait, seconds."""


class Sessions:
    """How many sessions are open, and whether one more may be."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.open = 0

    def admit(self) -> None:
        """Count one more session.

        Raises:
            Overloaded: there are as many as the service takes.
        """
        if self.open >= self.most:
            raise Overloaded(f"all {self.most} sessions that this service takes are open", retry_after=COME_BACK_S)
        self.open += 1

    def leave(self) -> None:
        """A session ended."""
        self.open -= 1


@dataclass(frozen=True, slots=True)
class Service:
    """The parts of a running service."""

    settings: Settings
    model: Model
    batcher: Batcher
    host: Host
    sessions: Sessions
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
        host = Host(
            model=model_info(model),
            metadata=model.metadata,
            limits=settings.limits,
            fingerprint=model.fingerprint,
            claim=engine.claim,
            skeletons=load_skeletons(settings.skeletons),
        )
        return cls(
            settings=settings,
            model=model,
            batcher=batcher,
            host=host,
            sessions=Sessions(settings.max_sessions),
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


def service_of(connection: HTTPConnection) -> Service:
    """The service that a request or a WebSocket came to."""
    service = connection.app.state.service
    assert isinstance(service, Service)
    return service
