"""Motions of many files: from the cache, or read by several processes at once.

Rules. Answers come in the order of what was asked, whatever finishes first. A file that can't be used is an answer
too: the sentence that says why. Processes are started only where there is work for them.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

from fervor.errors import InputError
from fervor_export.data.cache import Ask, load, save
from fervor_export.data.motion import Motion, read_motion

FEW = 60
"""So many files are read before a second process would have started."""

TOGETHER = 8
"""Files that a process is given at a time."""

Answer = Motion | str
"""The motion, or why there is none."""

Progress = Callable[[int, int], None]
"""Told how many files are done, of how many."""


def quietly(_done: int, _total: int) -> None:
    """A `Progress` that shows nothing."""


def load_motions(
    asked: Sequence[Ask], *, cache: Path | None, processes: int | None = None, progress: Progress = quietly
) -> list[Answer]:
    """The motions in files.

    Args:
        asked: which.
        cache: folder of motions that were read before; None for none.
        processes: to read with; by default one for each processor that is ours.
        progress: told after every file.
    """
    answers: list[Answer | None] = []
    done = 0
    for ask in asked:
        answers.append(None if cache is None else _kept(ask, cache))
        done += answers[-1] is not None
        progress(done, len(asked))
    waiting = [index for index, answer in enumerate(answers) if answer is None]
    for index, answer in zip(waiting, _read([asked[index] for index in waiting], cache, processes), strict=True):
        answers[index] = answer
        done += 1
        progress(done, len(asked))
    return [answer for answer in answers if answer is not None]


def _kept(ask: Ask, cache: Path) -> Motion | None:
    try:
        return load(cache, ask.key())
    except OSError:
        return None


def _read(asked: Sequence[Ask], cache: Path | None, processes: int | None) -> Iterator[Answer]:
    """Answers in order."""
    workers = processes or _processors()
    if workers < 2 or len(asked) <= FEW:
        yield from (_answer(ask, cache) for ask in asked)
        return
    done = 0
    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            for answer in pool.map(_answer, asked, [cache] * len(asked), chunksize=TOGETHER):
                yield answer
                done += 1
    except BrokenProcessPool:  # no room for processes, or a script without `if __name__ == "__main__"`
        yield from (_answer(ask, cache) for ask in asked[done:])


def _processors() -> int:
    """Those that are ours, where the system says so."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _answer(ask: Ask, cache: Path | None) -> Answer:
    """Reads one file, and keeps its motion."""
    try:
        motion = read_motion(ask.file, skeleton=ask.skeleton, start_s=ask.start_s, end_s=ask.end_s)
        if cache is not None:
            save(cache, ask.key(), motion)
    except InputError as error:
        return error.message.removeprefix(f"{ask.file}: ").removeprefix(f"{ask.file.parent}{os.sep}")
    except OSError as error:
        return f"can't be read: {error.strerror or error}"
    return motion
