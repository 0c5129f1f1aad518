"""The machine that figures come from, and which of its processors does what."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from fervor_bench.errors import BenchError

LIBRARIES = ("fervor", "numpy", "onnxruntime", "pydantic", "uvicorn", "uvloop", "websockets")


@dataclass(frozen=True, slots=True)
class Gaps:
    """How one busy processor was kept from a program that never waits; see `gaps`."""

    longest_ms: float
    share: float
    """Of the time."""
    others_share: float
    """Of the time, in which other programs of this machine ran; what is left is its host's."""

    @property
    def phrase(self) -> str:
        """In words."""
        if not self.share:
            return "not at all"
        whose = "by other programs" if self.others_share > self.share / 2 else "by the machine's host"
        return f"for up to {self.longest_ms:.1f} ms, {self.share:.1%} of the time, mostly {whose}"


@dataclass(frozen=True, slots=True)
class Interruptions:
    """What the machine does to who is busy on it."""

    processors: int
    together: Gaps
    """Of the one that lost most, while all of them were busy."""
    alone: Gaps
    """Of one while the others were not."""

    @property
    def sentence(self) -> str:
        """What tails of latency owe to the machine."""
        return (
            f"With {self.processors} processors busy one of them is taken away {self.together.phrase}; "
            f"with one busy, {self.alone.phrase} (gaps over 1 ms)"
        )


@dataclass(frozen=True, slots=True)
class Machine:
    """What figures depend on."""

    processor: str
    processors: int
    kernel: str
    python: str
    libraries: dict[str, str]
    load_1min: float
    """Of everything that ran when the run began; above 0.5 or so the machine is not quiet."""
    interruptions: Interruptions | None = None
    """None where they were not looked at."""

    @property
    def sentence(self) -> str:
        """The machine in one line."""
        return (
            f"{self.processor}, {self.processors} processors, Linux {self.kernel}, Python {self.python}, "
            f"onnxruntime {self.libraries['onnxruntime']}; load {self.load_1min:.1f} at the start"
        )


def describe_machine() -> Machine:
    """This machine, now."""
    return Machine(
        processor=_processor(),
        processors=len(os.sched_getaffinity(0)),
        kernel=platform.release(),
        python=platform.python_version(),
        libraries={name: version(name) for name in LIBRARIES},
        load_1min=os.getloadavg()[0],
    )


@dataclass(frozen=True, slots=True)
class Places:
    """Which processor runs the contestant, and which the load generator."""

    server: int
    generator: int


def choose_places() -> Places:
    """The last two processors that this process may use: the first ones have most of the interrupts.

    Raises:
        BenchError: there is only one.
    """
    free = sorted(os.sched_getaffinity(0))
    if len(free) < 2:
        raise BenchError("a contestant and its load need a processor each, but this process may use only one")
    return Places(server=free[-1], generator=free[-2])


@contextmanager
def pinned(processor: int) -> Iterator[None]:
    """What is started within stays on one processor."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {processor})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()
