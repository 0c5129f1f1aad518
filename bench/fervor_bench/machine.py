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
class Machine:
    """What figures depend on."""

    processor: str
    processors: int
    kernel: str
    python: str
    libraries: dict[str, str]
    load_1min: float
    """Of everything that ran when the run began; above 0.5 or so the machine is not quiet."""

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
