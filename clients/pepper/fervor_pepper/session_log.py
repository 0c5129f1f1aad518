"""The field-test recorder: a session as CSV, one row for each estimate and for all that the robot did.

Rules. Rows are only ever appended, each in one write and at once, so a crash costs no more than the row it fell into;
a row that was cut off is closed before the next. One file may hold many sessions. Of people it holds a code and what
their bodies showed: a code is letters, digits, `-` and `_`, so that no name or address slips in.

Columns: docs/reference/pepper.md.
"""

import csv
import io
import logging
import re
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from fervor.errors import DataError, InputError
from fervor.protocol.messages import Estimate
from fervor_pepper.acts import Act
from fervor_pepper.stage import Outcome

logger = logging.getLogger("fervor_pepper")

COLUMNS = (
    "time",
    "seconds",
    "participant",
    "condition",
    "kind",
    "body",
    "seq",
    "t",
    "emotion",
    "level",
    "intensity",
    "status",
    "flags",
    "act",
    "said",
    "gesture",
    "detail",
)

KINDS = ("begin", "estimate", "act", "done", "failed", "left", "lost", "end")
"""What a row may tell of."""

CODE = re.compile(r"[A-Za-z0-9_-]{1,16}")


def check_code(code: str, what: str = "participant") -> str:
    """A participant's or a condition's code, if it is one.

    Raises:
        InputError: it is none.
    """
    if CODE.fullmatch(code):
        return code
    raise InputError(f"{what} {code!r} is not a code; expected 1 to 16 letters, digits, - and _, and never a name")


class Appender:
    """Appends rows to a CSV file with given columns; writes the head where the file is new.

    Raises:
        DataError: the file has other columns, or can't be written.
    """

    def __init__(self, path: Path, columns: tuple[str, ...]) -> None:
        self.path = path
        try:
            head, whole = _look(path)
            if head is not None and head != columns:
                raise DataError(f"{path}: has the columns {', '.join(head)}; expected {', '.join(columns)}")
            self._file = path.open("ab", buffering=0)
            self._begin(columns if head is None else None, whole=whole)
        except OSError as error:
            raise DataError(f"{path}: can't be written: {error.strerror or error}") from None

    def _begin(self, head: tuple[str, ...] | None, *, whole: bool) -> None:
        try:
            if not whole:
                self._file.write(b"\n")
            if head is not None:
                self.append(head)
        except OSError:
            self.close()
            raise

    def append(self, cells: tuple[object, ...]) -> None:
        """Add a row, in one write."""
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(cells)
        self._file.write(line.getvalue().encode())

    def close(self) -> None:
        """Nothing more comes."""
        self._file.close()


class SessionLog:
    """The log of one participant in one condition."""

    def __init__(
        self, path: Path, *, participant: str, condition: str, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """`clock`: seconds, for the time into the session.

        Raises:
            InputError: a code that is none.
            DataError: the file is no log of ours, or can't be written.
        """
        self.participant = check_code(participant)
        self.condition = check_code(condition, "condition")
        self._clock = clock
        self._begun = clock()
        self._rows: Appender | None = Appender(path, COLUMNS)

    def begin(self, detail: str) -> None:
        """The session begins; `detail` says with what."""
        self._begun = self._clock()
        self._write("begin", detail=detail)

    def estimate(self, estimate: Estimate) -> None:
        """An estimate came."""
        self._write(
            "estimate",
            body=estimate.body,
            seq=estimate.seq,
            t=f"{estimate.t:.3f}",
            emotion=estimate.emotion,
            level=estimate.level or "",
            intensity="" if estimate.intensity is None else f"{estimate.intensity:.4f}",
            status=estimate.status,
            flags=" ".join(estimate.flags),
        )

    def act(self, act: Act) -> None:
        """The robot was told to do something."""
        self._write(
            "act", body=act.body, emotion=act.emotion, level=act.level, act=act.number, said=act.say,
            gesture=" ".join(act.gestures),
        )  # fmt: skip

    def outcome(self, outcome: Outcome) -> None:
        """It did, or could not."""
        act = outcome.act
        kind = "done" if outcome.error is None else "failed"
        detail = outcome.error.message if outcome.error else ""
        said = act.say if outcome.error is None else ""
        self._write(
            kind, body=act.body, emotion=act.emotion, level=act.level, act=act.number, said=said,
            gesture=outcome.gesture, detail=detail,
        )  # fmt: skip

    def left(self, body: str) -> None:
        """A person was said to be gone."""
        self._write("left", body=body)

    def lost(self, reason: str) -> None:
        """No more estimates come, against all plans."""
        self._write("lost", detail=reason)

    def end(self) -> None:
        """The session is over."""
        self._write("end")
        self.close()

    def close(self) -> None:
        """Let go of the file; nothing more is recorded."""
        if self._rows is not None:
            self._rows.close()
            self._rows = None

    def _write(self, kind: str, **cells: object) -> None:
        if self._rows is None:
            return
        assert kind in KINDS
        told = {
            "time": datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z"),
            "seconds": f"{self._clock() - self._begun:.3f}",
            "participant": self.participant,
            "condition": self.condition,
            "kind": kind,
            **{name: cell for name, cell in cells.items() if cell is not None},
        }
        try:
            self._rows.append(tuple(told.get(column, "") for column in COLUMNS))
        except OSError as error:
            logger.warning("%s: can't be written any more: %s", self._rows.path, error.strerror or error)
            self.close()


def _look(path: Path) -> tuple[tuple[str, ...] | None, bool]:
    """The head of a file, None where there is none yet, and whether its last row is whole."""
    if not path.exists() or path.stat().st_size == 0:
        return None, True
    with path.open("rb") as file:
        head = file.readline().decode("utf-8-sig", errors="replace")
        file.seek(-1, io.SEEK_END)
        whole = file.read(1) == b"\n"
    return tuple(next(csv.reader([head]), [])), whole
