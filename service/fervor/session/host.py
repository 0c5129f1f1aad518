"""The service, seen from a session."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from fervor.metadata import ModelMetadata
from fervor.protocol.messages import Limits, ModelInfo
from fervor.session.spread import Spread
from fervor.skeletons.skeleton import Skeleton


@dataclass(frozen=True, slots=True)
class Host:
    """What a session must know of the service it runs in."""

    model: ModelInfo
    metadata: ModelMetadata
    limits: Limits
    fingerprint: str
    claim: Callable[[], int]
    """Takes a free slot of the engine; raises Overloaded."""
    seal: Callable[[bytes], str] | None = None
    """Signs a checkpoint; None on a service that gives none."""
    unseal: Callable[[str], bytes] | None = None
    """Opens a token; raises CheckpointUnknown."""
    skeletons: Mapping[str, Skeleton] = field(default_factory=dict)
    """Skeletons beside the catalogue's, by name: calibrations kept on this service."""
    spread: Spread | None = None
    """Spreads the checkpoints of all sessions; None on a service of one."""
