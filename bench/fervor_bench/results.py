"""All results of a run, and their JSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fervor_bench.frame_cost import Inside
from fervor_bench.machine import Machine
from fervor_bench.plan import Plan
from fervor_bench.scoring import Beside, Rates
from fervor_bench.stages import Stage
from fervor_bench.standing import Standing


@dataclass(frozen=True, slots=True)
class Breakdown:
    """Where a frame's time goes, under one load."""

    name: str
    sessions: int
    server_us: float
    """A frame, all stages."""
    stages: tuple[Stage, ...]


@dataclass(frozen=True, slots=True)
class Results:
    """What one run of `fervor bench` found."""

    machine: Machine
    plan: Plan
    standings: Sequence[Standing]
    left_out: Sequence[str] = ()
    """Sentences: which contestant was not measured, and why."""
    breakdowns: Sequence[Breakdown] = ()
    insides: Sequence[Inside] = ()
    rates: Rates | None = None
    beside: Beside | None = None
    made: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))

    def write(self, path: Path) -> None:
        """Write them as JSON; what is infinite (frames without an answer) becomes null."""
        path.write_text(json.dumps(_finite(asdict(self)), indent=2) + "\n", encoding="utf-8")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
