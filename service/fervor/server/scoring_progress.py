"""How far a scoring request is, and the lines that tell a client who wants to know: newline-delimited JSON."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, Field

from fervor.errors import FervorError
from fervor.server.problems import Problem
from fervor.server.scoring_models import ScoreResponse

if TYPE_CHECKING:
    from fervor.server.scoring_process import Job, ScoringProcess

NDJSON = "application/x-ndjson"

EVERY_S = 0.1
"""Least time between two words about progress."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How many frames of a request are scored."""

    frames: int
    of: int


Told = Callable[[Progress], None]


class Meter:
    """Counts frames in the scoring process, and tells of them at once and then now and then."""

    def __init__(self, frames: int, tell: Told | None) -> None:
        self._done = 0
        self._of = frames
        self._tell = tell
        self._next = 0.0
        self.add(0)

    def add(self, frames: int) -> None:
        """So many frames more."""
        self._done += frames
        if self._tell and (now := time.monotonic()) >= self._next:
            self._next = now + EVERY_S
            self._tell(Progress(self._done, self._of))


class ProgressLine(BaseModel):
    """So many frames are scored; the first line says 0, later ones come ten times a second at most."""

    type: Literal["progress"] = "progress"
    frames: int = Field(description="scored so far")
    of: int = Field(description="frames of the request")


class ScoresLine(BaseModel):
    """The last line of a request that went well."""

    type: Literal["scores"] = "scores"
    scores: ScoreResponse


class ProblemLine(BaseModel):
    """The last line of one that failed on its way; what fails before the first line is an HTTP problem."""

    type: Literal["problem"] = "problem"
    problem: Problem


LINES = (ProgressLine, ScoresLine, ProblemLine)


def wants_lines(accept: str) -> bool:
    """Whether a header Accept asks for lines."""
    return any(kind.partition(";")[0].strip().lower() == NDJSON for kind in accept.split(","))


async def lines_of(scoring: "ScoringProcess", job: "Job", *arguments: object) -> AsyncIterator[bytes]:
    """Do a job and tell of it, a line at a time. Who stops listening gives the job up.

    Raises:
        FervorError: the job failed before the first line.
    """
    told: asyncio.Queue[Progress | None] = asyncio.Queue()
    work = asyncio.create_task(scoring.run(job, *arguments, told=told.put_nowait))
    work.add_done_callback(lambda _: told.put_nowait(None))
    begun = False
    try:
        while progress := await told.get():
            begun = True
            yield _line(ProgressLine(frames=progress.frames, of=progress.of))
        yield b'{"type":"scores","scores":' + await work + b"}\n"
    except FervorError as error:
        if not begun:
            raise
        yield _line(ProblemLine(problem=_problem(error)))
    finally:
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)


def _line(line: BaseModel) -> bytes:
    return line.model_dump_json(exclude_none=True).encode() + b"\n"


def _problem(error: FervorError) -> Problem:
    return Problem(
        type="about:blank",
        title=HTTPStatus(error.http_status).phrase,
        status=error.http_status,
        detail=error.message,
        code=error.code,
        retry_after=error.retry_after,
    )
