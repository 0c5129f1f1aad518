"""The other end of the scoring process: `python -m fervor.server.scoring_worker`, started by `scoring_process` alone.

Answers one question after the other until its standard input closes, which it does when the service ends, however that
ended. No question may bring it down; one that does costs its own request only.
"""

import logging
import os
import pickle
import resource
import signal
import sys
from contextlib import suppress
from typing import IO

from fervor.errors import EngineError, FervorError, ModelFileError
from fervor.model import Model
from fervor.server.kept_skeletons import load_skeletons
from fervor.server.logs import configure_logs
from fervor.server.scoring_jobs import ScoringJobs
from fervor.server.scoring_process import LENGTH, Start
from fervor.server.scoring_progress import Progress, Told

log = logging.getLogger(__name__)

NICENESS = 5
"""How far the process stands back behind live sessions."""

MOST_MEMORY = 8 * 1024**3
"""Bytes that the process may take, so that an upload that unfolds without end fails alone."""


class Worker:
    """The jobs and the model they need, loaded with the first question."""

    def __init__(self, start: Start) -> None:
        self._start = start
        self._jobs: ScoringJobs | None = None

    def answer(self, question: bytes, tell: Told) -> bytes | FervorError:
        """The response body for a pickled job, or the error to raise in its place; `tell` is told of progress."""
        try:
            job, arguments, wants_progress = pickle.loads(question)  # noqa: S301  # from our own service
            told = {"tell": tell} if wants_progress else {}
            answer = getattr(self._open(), job)(*arguments, **told)
        except FervorError as error:
            return error
        except Exception:
            log.exception("a scoring request failed")
            return EngineError("the service failed on this request; the fault is its own and was logged")
        assert isinstance(answer, bytes)
        return answer

    def _open(self) -> ScoringJobs:
        if self._jobs is None:
            start = self._start
            skeletons = load_skeletons(start.skeletons)
            self._jobs = ScoringJobs(self._load(), start.allowed, skeletons, row_multiple=start.row_multiple)
        return self._jobs

    def _load(self) -> Model:
        """The model of the service, and no other that has taken its place."""
        with suppress(ModelFileError):
            model = Model.load(self._start.model)
            if model.sha256 == self._start.sha256:
                return model
        raise EngineError("the model file changed since the service started; the service must be started again")


def serve(questions: IO[bytes], answers: IO[bytes]) -> None:
    """Answer until there are no more questions; the first one says how to start."""
    start = pickle.loads(_read(questions))  # noqa: S301  # from our own service
    configure_logs(*start.logs)
    worker = Worker(start)

    def say(what: bytes | FervorError | Progress) -> None:
        said = pickle.dumps(what)
        answers.write(LENGTH.pack(len(said)) + said)
        answers.flush()

    while question := _read(questions):
        say(worker.answer(question, say))


def _read(questions: IO[bytes]) -> bytes:
    """The next question; empty at the end."""
    header = questions.read(LENGTH.size)
    return questions.read(*LENGTH.unpack(header)) if len(header) == LENGTH.size else b""


def main() -> None:
    """Run as a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the service, which then ends us
    os.nice(NICENESS)
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY if hard < 0 else min(MOST_MEMORY, hard), hard))
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # whatever prints, prints to the log
        serve(sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()
