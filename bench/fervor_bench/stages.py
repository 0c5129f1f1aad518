"""Where a frame's microseconds go: a running service sampled from outside, by the innermost part of ours on the stack.

py-spy looks at the interpreter's stacks a few hundred times a second, and on x86 at what C does below it, the calls of
the kernel included. A sample belongs to the first rule that fits, from the innermost function outwards; what a library
does is its caller's. Rules go by package, so that they outlive a file's name.
"""

import ctypes
import platform
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

PR_SET_PTRACER, PR_SET_PTRACER_ANY = 0x59616D61, -1
"""Of prctl(2)."""

PROGRAM = "fervor_bench/serve.py"
"""At the root of the service's own thread; others only wait."""

RULES: tuple[tuple[str, str], ...] = (
    ("kernel: write", r"^(__)?(libc_)?(write|writev|send|sendmsg|sendto)\b.*\(libc"),
    ("kernel: read", r"^(__)?(libc_)?(read|readv|recv|recvmsg|recvfrom)\b.*\(libc"),
    ("kernel: poll", r"^epoll_p?wait"),
    ("collector", r"^gc_collect\w*"),
    ("model", r"\((fervor/model\.py|onnxruntime/)"),
    ("checkpoint", r"(checkpoint|seal).*\(fervor/|\(fervor/.*(checkpoint|seal)"),
    ("encode", r"encod.*\(fervor/|\(fervor/.*encod"),
    ("decode", r"\(fervor/(protocol/(?!\w*(trusted|messages|estimate))|session/poses)|\bdecode\w*.*\(fervor/"),
    ("engine", r"\(fervor/(engine|skeletons|rotations|emotions)"),
    ("session", r"\(fervor/(session|levels|calibration)"),
    ("send", r"(\bwrite|\bsend|_as_frame).*\(fervor/server|\(fervor/server/(outbox|wire|asgi_wire)"),
    ("receive", r"\(fervor/server/(websocket|direct_wire|cutter|parser)"),
    ("conversation", r"\(fervor/server/(?!run\b|worker|supervisor)"),
)
"""Stage, and a pattern of `function (file`; the first that fits."""

REST = "event loop"
"""What no rule claims: the loop itself."""


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
        counts[stage_of(stack)] += samples
    total = sum(counts.values())
    return [Stage(name, samples / total) for name, samples in counts.most_common()]


def stage_of(stack: str) -> str:
    """The stage that a sample belongs to."""
    for frame in reversed(stack.split(";")):
        for stage, pattern in RULES:
            if re.search(pattern, frame):
                return stage
    return REST


def read_stacks(path: Path, program: str = PROGRAM) -> dict[str, int]:
    """Samples by stack from py-spy's `raw` format, of the thread that runs a program."""
    stacks: Counter[str] = Counter()
    for line in path.read_text(encoding="utf-8").splitlines():
        stack, _, samples = line.rpartition(" ")
        if program in stack:
            stacks[stack] += int(samples)
    return dict(stacks)


def allow_sampling() -> None:
    """Let any process of this user look into this one, where Linux (Yama) keeps that to parents."""
    # Where there is no Yama this is refused, and not needed.
    ctypes.CDLL(None).prctl(PR_SET_PTRACER, ctypes.c_long(PR_SET_PTRACER_ANY), 0, 0, 0)


@contextmanager
def sampled(pid: int, path: Path) -> Iterator[None]:
    """Sample a process during the block; the stacks are in `path` after it.

    Raises:
        BenchError: py-spy may not look at that process.
    """
    spy = shutil.which("py-spy", path=str(Path(sys.executable).parent)) or shutil.which("py-spy")
    if spy is None:
        raise BenchError("stages need py-spy, which is not installed: pip install 'fervor[bench]'")
    how = "--native" if platform.machine() == "x86_64" else "--nonblocking"
    command = [spy, "record", "--pid", str(pid), how, "--rate", str(SAMPLES_PER_SECOND), "--format", "raw"]
    process = subprocess.Popen(
        [*command, "--output", str(path), "--duration", "unlimited"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
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
