"""The scoring process: whole recordings are scored beside the service, not in it.

Rules. A process of its own, because scoring is mostly Python: a thread would hold the interpreter for milliseconds at a
time, and every live session would feel it. It is started by the first request, runs one request at a time at low
priority, ends when the service does (its standard input closes), and is started again if it dies: a recording that
brings it down costs its own request at most.

Both ends speak pickles with a length before them, over the pipes of the process: a question, then words about its
progress where they are wanted, then the answer.
"""

import asyncio
import logging
import pickle
import struct
import sys
import time
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from fervor.errors import EngineError, FervorError, Overloaded
from fervor.server.scoring_progress import Progress, Told
from fervor.settings import LogFormat, LogLevel

log = logging.getLogger(__name__)

Job = Literal["score", "score_files", "convert_file"]
"""A method of `ScoringJobs`."""

LENGTH = struct.Struct("!Q")
"""How a length is written."""

WORKER = "fervor.server.scoring_worker"
"""The module that the process runs."""


@dataclass(frozen=True, slots=True)
class Allowed:
    """How much one request may bring."""

    frames: int
    sequences: int


@dataclass(frozen=True, slots=True)
class Start:
    """What the process needs to know before the first job."""

    model: Path
    sha256: str
    """Of the model file that the service runs; the process must not run another."""
    row_multiple: int
    skeletons: Path | None
    allowed: Allowed
    logs: tuple[LogFormat, LogLevel] = ("text", "info")


class ScoringProcess:
    """The service's end; the other one is `scoring_worker`."""

    def __init__(self, start: Start, *, most_waiting: int, timeout_s: float) -> None:
        self._how = start
        self._most_waiting = most_waiting
        self._timeout_s = timeout_s
        self.waiting = 0
        """Requests under way."""
        self.refused = 0
        self._watchers: list[Callable[[float], None]] = []
        self._turn = asyncio.Lock()
        self._process: Process | None = None

    def watch(self, watcher: Callable[[float], None]) -> None:
        """Be told how many seconds each job took."""
        self._watchers.append(watcher)

    async def run(self, job: Job, *arguments: object, told: Told | None = None) -> bytes:
        """Do a job when its turn comes, and return the response body.

        Args:
            job: what to do.
            arguments: its own.
            told: called with its progress, now and then.

        Raises:
            FervorError: whatever the job raised.
            Overloaded: too many requests wait already, or this one took too long.
            EngineError: the process ended without an answer.
        """
        if self.waiting >= self._most_waiting:
            self.refused += 1
            raise Overloaded(f"{self.waiting} scoring requests wait already; try again later", retry_after=5.0)
        self.waiting += 1
        try:
            async with self._turn:
                began = time.perf_counter()
                answer = await self._ask_for_so_long(pickle.dumps((job, arguments, bool(told))), told)
                for watcher in self._watchers:
                    watcher(time.perf_counter() - began)
        finally:
            self.waiting -= 1
        if isinstance(answer, FervorError):
            raise answer
        return answer

    async def close(self) -> None:
        """End the process, whatever it is doing."""
        if self._process is not None:
            _kill(self._process)  # a request under way ends now, and gives up its turn
        async with self._turn:
            await self._discard()

    async def _ask_for_so_long(self, question: bytes, told: Told | None) -> bytes | FervorError:
        try:
            async with asyncio.timeout(self._timeout_s):
                return await self._ask(question, told)
        except TimeoutError:
            return Overloaded(f"the request took longer than {self._timeout_s:g} s, and was given up")

    async def _ask(self, question: bytes, told: Told | None) -> bytes | FervorError:
        if self._process is not None and self._process.returncode is not None:
            await self._discard()  # it died between two requests, which need not cost either
        process = self._process or await self._start()
        try:
            await _write(process, question)
            while isinstance(answer := await _read(process), Progress):
                if told:
                    told(answer)
        except (asyncio.IncompleteReadError, OSError):
            await self._discard()
            log.exception("the scoring process ended")
            raise EngineError("the scoring process ended on this request; the fault is the service's own") from None
        except asyncio.CancelledError:
            await self._discard()  # its answer would be taken for the next one's
            raise
        assert isinstance(answer, bytes | FervorError)
        return answer

    async def _discard(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            _kill(process)
            assert process.stdin is not None
            process.stdin.close()
            await process.communicate()

    async def _start(self) -> Process:
        command = (sys.executable, "-P", "-m", WORKER)
        self._process = await asyncio.create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE)
        await _write(self._process, pickle.dumps(self._how))
        return self._process


async def _write(process: Process, content: bytes) -> None:
    assert process.stdin is not None
    try:
        process.stdin.write(LENGTH.pack(len(content)) + content)
        await process.stdin.drain()
    except RuntimeError as problem:  # uvloop's word for a pipe that is closed already
        raise BrokenPipeError(str(problem)) from problem


async def _read(process: Process) -> object:
    assert process.stdout is not None
    (length,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
    return pickle.loads(await process.stdout.readexactly(length))  # noqa: S301  # our own process


def _kill(process: Process) -> None:
    with suppress(ProcessLookupError):
        process.kill()
