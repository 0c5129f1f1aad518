"""Where a frame's microseconds go: a running service sampled from outside, by the innermost part of ours on the stack.

py-spy looks at the interpreter's stacks a few hundred times a second without stopping it. A sample belongs to the
first rule that fits, from the innermost function outwards; what a library does is its caller's.
"""

import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fervor_bench.errors import BenchError

SAMPLES_PER_SECOND = 250

RULES: tuple[tuple[str, str], ...] = (
    (
        "parse and validate",
        r"decode_(client|frames)|_from_raw|_joints_of|fervor/protocol/(frame_decoder|poses|lean_frame)|fervor/session/poses|fervor/server/pace",
    ),
    ("encode", r"\bencode\b.*fervor/protocol|fervor/server/encod"),
    ("checkpoint", r"checkpoint|sealing"),
    ("model", r"fervor/model\.py"),
    ("engine", r"fervor/(engine|skeletons|rotations|emotions)"),
    ("session", r"fervor/(session|levels)"),
    ("send", r"\b(write|_as_frame)\b.*fervor/server/websocket_protocol"),
    ("send", r"fervor/server/outbox|\bsend(_\w+)?\b.*(uvicorn|starlette|websockets)|\b_?(write|send)\w*\b.*asyncio"),
    ("receive", r"fervor/server/(cutter|websocket_protocol)"),
    ("receive", r"data_received|handle_\w+.*uvicorn|\breceive\w*\b|(websockets)/(frames|protocol|streams)"),
    ("metrics", r"fervor/server/metrics|prometheus_client"),
    ("conversation", r"fervor/server"),
)
"""Stage, and a pattern of `function (file`; the first that fits."""

REST = "event loop"
"""What no rule claims: the loop itself, the kernel's part of reading and polling, the collector."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of a frame's way."""

    name: str
    share: float
    """Of the samples."""


def share_out(stacks: Mapping[str, int]) -> list[Stage]:
    """Stages by share, largest first.

    Args:
        stacks: samples by collapsed stack, "outermost (file:line);...;innermost (file:line)".
    """
    counts: Counter[str] = Counter()
    for stack, samples in stacks.items():
        counts[_stage_of(stack)] += samples
    total = sum(counts.values())
    return [Stage(name, samples / total) for name, samples in counts.most_common()]


def _stage_of(stack: str) -> str:
    for frame in reversed(stack.split(";")):
        for stage, pattern in RULES:
            if re.search(pattern, frame):
                return stage
    return REST


def read_stacks(path: Path) -> dict[str, int]:
    """Samples by stack from py-spy's `raw` format."""
    stacks: Counter[str] = Counter()
    for line in path.read_text(encoding="utf-8").splitlines():
        stack, _, samples = line.rpartition(" ")
        stacks[stack] += int(samples)
    return dict(stacks)


@contextmanager
def sampled(pid: int, path: Path) -> Iterator[None]:
    """Sample a process during the block; the stacks are in `path` after it.

    Raises:
        BenchError: py-spy may not look at that process.
    """
    spy = shutil.which("py-spy", path=str(Path(sys.executable).parent)) or shutil.which("py-spy")
    if spy is None:
        raise BenchError("stages need py-spy, which is not installed: pip install 'fervor[bench]'")
    rate = str(SAMPLES_PER_SECOND)
    command = [spy, "record", "--pid", str(pid), "--nonblocking", "--rate", rate, "--format", "raw", "-o", str(path)]
    process = subprocess.Popen([*command, "--duration", "unlimited"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        yield
    finally:
        process.send_signal(2)  # as Ctrl-C: it writes what it has
        said, _ = process.communicate()
    if not path.exists():
        last = said.decode(errors="replace").strip().rpartition("\n")[2]
        raise BenchError(
            f"py-spy could not sample the service: {last}; root may, or a sysctl kernel.yama.ptrace_scope=0"
        )
