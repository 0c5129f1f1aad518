"""What a data set says of its recordings, before any motion is read, and what is wrong with it.

Findings are collected, never raised one by one: whoever mends a data set wants all of them at once.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from fervor_export.data.label import Label

Severity = Literal["unusable", "doubt", "skipped"]
"""`unusable`: left out, though it should not be; `doubt`: used, but look at it; `skipped`: left out as is known."""

Kind = Literal["synthetic", "ebmdb", "ebmdb_tags", "manifest"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something wrong with one row or file, or with the data set as a whole."""

    severity: Severity
    where: str
    """Row or file: "row 12 (walk.bvh)"."""
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"

    @property
    def place(self) -> float:
        """Where to list it: what concerns a column first, then by line, then files."""
        line = re.match(r"line (\d+)", self.where)
        return float(line[1]) if line else 0.0 if self.where.startswith("column") else math.inf


@dataclass(frozen=True, slots=True)
class Entry:
    """What a data set says of one clip."""

    where: str
    """Row or file, for messages."""
    file: Path
    name: str
    """The recording; clips cut from one file share it."""
    actor: str
    emotion: str
    label: Label | None
    """None where the data set says nothing that makes an intensity."""
    split: str | None = None
    skeleton: str | None = None
    start_s: float | None = None
    """In the file's own time; None for its beginning."""
    end_s: float | None = None
    told_s: float | None = None
    """How long the recording should be, where the data set says so."""


@dataclass(slots=True)
class Listing:
    """All entries of a data set, and all findings."""

    kind: Kind
    description: str
    entries: list[Entry] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def unusable(self, where: str, what: str) -> None:
        """Notes what had to be left out."""
        self.findings.append(Finding("unusable", where, what))

    def doubt(self, where: str, what: str) -> None:
        """Notes what is used all the same."""
        self.findings.append(Finding("doubt", where, what))

    def skip(self, where: str, what: str) -> None:
        """Notes what is left out as the data set's own readers know."""
        self.findings.append(Finding("skipped", where, what))


def one_sentence(findings: Sequence[Finding], source: str) -> str:
    """The unusable findings in one sentence: how many, and the first."""
    bad = [finding for finding in findings if finding.severity == "unusable"]
    count = f"{len(bad)} problem{'s' if len(bad) != 1 else ''}"
    return f"{source}: {count}, the first: {bad[0]}; `fervor data check` lists all"
