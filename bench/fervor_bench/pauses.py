"""How long the interpreter's garbage collector stopped a service, as the service's process notes it itself.

A record a collection, at once: whoever is stopped by a signal has no time left to write.
"""

import gc
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RECORD = np.dtype([("begin_s", "<f8"), ("seconds", "<f8"), ("generation", "<f8")])
"""Begin on the machine's monotonic clock, which all processes share."""

Window = tuple[float, float]
"""Begin and end, seconds on the monotonic clock."""


@dataclass(frozen=True, slots=True)
class Pauses:
    """Of some windows of a service together."""

    young: int
    """Collections of the youngest generation."""
    older: int
    longest_ms: float
    share: float
    """Of the time."""


def note_pauses(path: Path) -> None:
    """From now on, append every collection of this process to a file."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    begin_s = 0.0

    def note(phase: str, about: dict[str, int]) -> None:
        nonlocal begin_s
        if phase == "start":
            begin_s = time.monotonic()
        else:
            record = (begin_s, time.monotonic() - begin_s, about["generation"])
            os.write(file, np.array(record, RECORD).tobytes())

    gc.callbacks.append(note)


def read_pauses(path: Path, windows: Sequence[Window]) -> Pauses | None:
    """What was noted in some windows; None where nothing was noted at all, or there is no window."""
    if not path.exists() or not windows:
        return None
    noted = np.fromfile(path, RECORD)
    within = np.zeros(len(noted), np.bool_)
    for begin, end in windows:
        within |= (noted["begin_s"] >= begin) & (noted["begin_s"] < end)
    noted = noted[within]
    young = int(np.count_nonzero(noted["generation"] == 0))
    return Pauses(
        young=young,
        older=len(noted) - young,
        longest_ms=1000.0 * float(noted["seconds"].max(initial=0.0)),
        share=float(noted["seconds"].sum()) / sum(end - begin for begin, end in windows),
    )
