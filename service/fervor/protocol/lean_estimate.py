"""Estimates as the service gives them by the thousand: structures that msgspec makes, and encodes, in C.

On the wire they are `fervor.protocol.messages.Estimate` and `Estimates`, and who reads them sees those.
"""

from collections.abc import Mapping
from typing import ClassVar, Literal

from msgspec import Struct

from fervor.levels import Level
from fervor.protocol.messages import Estimate, Estimates, Flag, Status
from fervor.protocol.trusted import trusted


class LeanEstimate(Struct, tag_field="type", tag="estimate", frozen=True, gc=False):
    """An `Estimate`, field by field."""

    type: ClassVar[Literal["estimate"]] = "estimate"
    body: str
    seq: int
    t: float  # seconds, client clock
    intensity: float | None
    level: Level | None
    emotion: str
    status: Status
    flags: tuple[Flag, ...] = ()
    by_emotion: Mapping[str, float] | None = None

    def to_message(self) -> Estimate:
        """The same as any other message."""
        names = self.__struct_fields__
        return trusted(Estimate, {"type": "estimate"} | {name: getattr(self, name) for name in names})


class LeanEstimates(Struct, tag_field="type", tag="estimates", frozen=True, gc=False):
    """An `Estimates`."""

    type: ClassVar[Literal["estimates"]] = "estimates"
    estimates: tuple[LeanEstimate, ...]

    def to_message(self) -> Estimates:
        """The same as any other message."""
        answers = tuple(estimate.to_message() for estimate in self.estimates)
        return trusted(Estimates, {"type": "estimates", "estimates": answers})
