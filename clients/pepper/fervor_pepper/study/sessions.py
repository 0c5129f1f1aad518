"""What the robot did in a study's sessions, by condition: whether the conditions differed as they were meant to."""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fervor_pepper.session_log import COLUMNS


@dataclass(slots=True)
class Doings:
    """All sessions of one condition, from their logs."""

    condition: str
    participants: set[str] = field(default_factory=set)
    sessions: int = 0
    seconds: float = 0.0
    spoken: int = 0
    gestures: int = 0
    failed: int = 0
    estimates: int = 0
    strong: int = 0
    """Estimates at level strong."""

    def as_dict(self) -> dict[str, object]:
        """Plain values; participants as their number."""
        shown = {name: getattr(self, name) for name in self.__slots__}
        return {**shown, "participants": len(self.participants), "seconds": round(self.seconds, 3)}


def read_sessions(folder: Path) -> list[Doings]:
    """Everything that session logs in a folder tell, by condition; files that are no logs are passed over."""
    found: dict[str, Doings] = {}
    for path in sorted(folder.rglob("*.csv")):
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            table = csv.DictReader(file)
            if tuple(table.fieldnames or ()) == COLUMNS:
                _count(table, found)
    return sorted(found.values(), key=lambda doings: doings.condition)


def _count(rows: Iterable[Mapping[str, str | None]], found: dict[str, Doings]) -> None:
    last = 0.0
    for row in rows:
        seconds = _number(row["seconds"])
        if not row["condition"] or seconds is None:  # a row that a crash cut off
            continue
        doings = found.setdefault(row["condition"], Doings(row["condition"]))
        if row["kind"] == "begin":
            doings.sessions += 1
            last = 0.0
        doings.participants.add(row["participant"] or "")
        doings.seconds += max(seconds - last, 0.0)
        last = seconds
        done = row["kind"] == "done"
        doings.spoken += bool(done and row["said"])
        doings.gestures += bool(done and row["gesture"])
        doings.failed += row["kind"] == "failed"
        doings.estimates += row["kind"] == "estimate"
        doings.strong += row["kind"] == "estimate" and row["level"] == "strong"


def _number(cell: str | None) -> float | None:
    try:
        return float(cell or "")
    except ValueError:
        return None
