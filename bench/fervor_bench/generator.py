"""The load generator as a process: started, ready, told to go, and asked what it saw."""

import json
import math
import select
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from fervor_bench.errors import BenchError
from fervor_bench.machine import pinned

Loop = Literal["open", "closed"]
Arrivals = Literal["random", "lockstep"]
Waits = Literal["spin", "sleep"]

CONNECT_S = 90.0
"""Longest wait for all sessions to be started."""

SETTLE_S = 60.0
"""Longest that they may take to settle; see load.c."""


@dataclass(frozen=True, slots=True)
class Load:
    """How much is sent, and when."""

    sessions: int
    loop: Loop = "open"
    """`open`: every session keeps its own schedule; `closed`: it sends the next message when it has its answer."""
    arrivals: Arrivals = "random"
    """Open loop: schedules at random phases, or all at the same instants."""
    warmup_s: float = 1.0
    seconds: float = 5.0
    """The window that is measured, after the warm-up."""
    settle_s: float = 0.0
    """Seconds of the sensors' clocks that every session sends before it all, as fast as it is answered."""
    waits: Waits = "sleep"
    """How the generator waits: `spin` keeps its processor busy and times exact, `sleep` leaves room for others."""
    backlog_s: float = math.inf
    """Open loop: it is lost, and ends, where the frames of so many seconds wait for their answers."""
    late_s: float = math.inf
    """Open loop: likewise where 1 % of the window's frames are known to be answered later than this."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What the generator saw in its window."""

    sessions: int
    """Open at the end."""
    refused: int
    closed: int
    errors: int
    first_error: str
    frames: int
    """Answered in the window."""
    unanswered: int
    """Frames due in the window that have no answer two seconds after it; open loop."""
    under_way: int
    """Frames of any time without an answer, and messages that could not be sent to their end."""
    checkpoints: int
    blocked: int
    """How often a session could not send because the service did not read."""
    dry: bool
    """The script came to its end before the window did."""
    lost: bool
    """The window ended early; see `Load`."""
    window_s: float
    busy_s: float
    """How long the generator had work: its processor time, or where it spins, what it was not waiting."""
    latencies: npt.NDArray[np.float32]  # [frame] µs, of the frames due (open loop) or answered in the window
    lags: npt.NDArray[np.float32]  # [message] µs, how late the generator was; open loop


class Generator:
    """A process `load`: sessions that are opened, and sent over in one run or several.

    As a context manager: whatever happens, the process is gone afterwards.
    """

    def __init__(
        self,
        program: Path,
        script: Path,
        *,
        address: tuple[str, int],
        most: int,
        arrivals: Arrivals,
        settle: int,
        processor: int,
        result: Path,
    ) -> None:
        """Start it.

        Args:
            program: the compiled `load`.
            script: what it sends, as `Traffic.write` makes it.
            address: host and port of the service.
            most: sessions that it will ever have at a time.
            arrivals: of the messages, in open loops.
            settle: messages of a session that go ahead of its first schedule.
            processor: to run on.
            result: the file for what it saw.
        """
        self._result = result
        host, port = address
        words = [str(program), host, str(port), str(script), str(result), str(most), arrivals, str(settle)]
        with pinned(processor):
            self._process = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
            )  # no buffer: `select` must see every line that was not read

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process, and its sessions with it."""
        self._process.kill()
        self._process.communicate()

    def open(self, sessions: int) -> int:
        """Have so many sessions, those of before among them, and wait for all to be started; returns how many are.

        Raises:
            BenchError: none is; says what the service answered.
        """
        self._tell(f"open {sessions}")
        _, started, refused, *why = self._hear("ready", CONNECT_S).split(" ", 3)
        if int(started) == 0:
            raise BenchError(f"none of {refused} sessions could be started: {' '.join(why) or 'no answer'}")
        return int(started)

    def run(self, load: Load, at_begin: Callable[[], None], at_end: Callable[[], None]) -> Seen:
        """Send over the sessions that are open; the two callbacks are called at the edges of the measured window.

        Raises:
            BenchError: the generator ended before its time.
        """
        times = (load.warmup_s, load.seconds, load.backlog_s, load.late_s)
        self._tell(f"run {load.loop} {load.waits} {' '.join(map(str, times))}")
        patience = SETTLE_S + load.warmup_s + load.seconds + 30.0
        if self._hear("", patience) == "begin":
            at_begin()
            self._hear("end", patience)
        at_end()
        told: dict[str, Any] = json.loads(self._hear("{", patience))
        with self._result.open("rb") as file:
            series = [np.fromfile(file, "<f4", int(np.fromfile(file, "<u8", 1)[0])) for _ in range(2)]
        return Seen(**told, latencies=series[0], lags=series[1])

    def _tell(self, line: str) -> None:
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(f"{line}\n".encode())

    def _hear(self, beginning: str, seconds: float) -> str:
        assert self._process.stdout is not None
        readable, _, _ = select.select([self._process.stdout], [], [], seconds)
        line = self._process.stdout.readline().decode().strip() if readable else ""
        if not line or not line.startswith(beginning):
            raise BenchError(f"the load generator said {line!r} where {beginning!r} was expected")
        return line
