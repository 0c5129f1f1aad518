"""Percentiles of latencies, frames that got no answer counted as waiting for ever."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

PERCENTS = (50.0, 99.0, 99.9)


@dataclass(frozen=True, slots=True)
class Latency:
    """Milliseconds within which a share of the frames was answered; infinite where too few were."""

    p50_ms: float
    p99_ms: float
    p999_ms: float
    largest_ms: float

    @classmethod
    def of(cls, microseconds: npt.NDArray[np.float32], unanswered: int = 0) -> "Latency":
        """Percentiles by rank: the smallest latency that at least so many per cent of all frames kept.

        Args:
            microseconds: [frame] in any order.
            unanswered: frames beside them that have no answer.
        """
        ordered = np.sort(microseconds)
        count = len(ordered) + unanswered
        values = []
        for percent in (*PERCENTS, 100.0):
            rank = max(math.ceil(count * percent / 100.0), 1)
            values.append(float(ordered[rank - 1]) / 1000.0 if rank <= len(ordered) else math.inf)
        return cls(*values)
