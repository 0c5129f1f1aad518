"""How long a program that never waits is kept from running, as it notes it itself: what tails of latency are made of.

On a machine that others use, or that is itself a guest of another, a processor may be gone for milliseconds. Often that
happens only while all processors are busy: else whoever wants one takes one that is free.
"""

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from resource import RUSAGE_SELF, getrusage

from fervor_bench.errors import BenchError
from fervor_bench.machine import Gaps, Interruptions, pinned

LEAST_S = 0.001
"""Shorter gaps are the kernel's housekeeping."""

START_S = 0.3
"""Until all programs are there, and begin together."""


@dataclass(frozen=True, slots=True)
class Gap:
    """For so long a program did not run."""

    seconds: float
    switched: bool
    """Whether another program ran instead; else the machine's host did not let this processor run."""


def measure_interruptions(processors: Sequence[int], seconds: float) -> Interruptions:
    """Keep all of some processors busy, then the first one alone, for so many seconds each.

    Raises:
        BenchError: that could not be done; says what Python said.
    """
    together = [summarise(gaps, seconds) for gaps in _busy(processors, seconds)]
    (alone,) = [summarise(gaps, seconds) for gaps in _busy(processors[:1], seconds)]
    return Interruptions(len(processors), max(together, key=lambda gaps: gaps.share), alone)


def summarise(gaps: Sequence[Gap], seconds: float) -> Gaps:
    """The gaps of one processor that was to be busy for so many seconds."""
    return Gaps(
        longest_ms=1000.0 * max((gap.seconds for gap in gaps), default=0.0),
        share=sum(gap.seconds for gap in gaps) / seconds,
        others_share=sum(gap.seconds for gap in gaps if gap.switched) / seconds,
    )


def note_gaps(begin_s: float, seconds: float) -> list[Gap]:
    """Do nothing but look at the clock, from a time of the monotonic clock on."""
    gaps = []
    before, switches = max(time.monotonic(), begin_s), _switches()
    while (now := time.monotonic()) < begin_s:
        switches = _switches()
    while now < begin_s + seconds:
        now, switched = time.monotonic(), _switches()
        if now - before > LEAST_S:
            gaps.append(Gap(now - before, switched > switches))
        before, switches = now, switched
    return gaps


def _busy(processors: Sequence[int], seconds: float) -> list[list[Gap]]:
    """The gaps of each of some processors that are kept busy together."""
    command = [sys.executable, "-m", "fervor_bench.gaps", str(time.monotonic() + START_S), str(seconds)]
    running = []
    for processor in processors:
        with pinned(processor):
            running.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
    told = [process.communicate() for process in running]
    for process, (_, complaint) in zip(running, told, strict=True):
        if process.returncode:
            raise BenchError(f"the machine could not be looked at: {complaint.strip().rpartition(chr(10))[2]}")
    return [[Gap(*gap) for gap in json.loads(said)] for said, _ in told]


def _switches() -> int:
    """How often this process had to give way."""
    return getrusage(RUSAGE_SELF).ru_nivcsw


if __name__ == "__main__":
    noted = note_gaps(float(sys.argv[1]), float(sys.argv[2]))
    print(json.dumps([(gap.seconds, gap.switched) for gap in noted]))
