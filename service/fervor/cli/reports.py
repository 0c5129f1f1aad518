"""What `fervor score` writes: a table for people, CSV for spreadsheets, JSON for programs."""

import csv
import io
import sys
from collections.abc import Iterator
from enum import Enum
from pathlib import Path

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fervor.emotions import UNKNOWN
from fervor.errors import FervorError
from fervor.server.scoring_models import ScoreResponse, SequenceScore

SUMMARY = ("file", "emotion", "frames", "duration_s", "mean", "peak", "last", "strong", "level")
FRAMES = ("file", "seq", "t", "intensity", "level", "emotion", "status", "flags")

UNPIPED_WIDTH = 160
"""Columns of a table that nobody's terminal limits."""


class Format(Enum):
    """How a report is written."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


class CannotWrite(FervorError):
    """A report can't be written where it was wanted."""

    code = "cannot_write"
    exit_code = 73


def choose_format(*, as_json: bool, as_csv: bool, out: Path | None) -> Format:
    """The format asked for, by an option or by the name of the file to write."""
    if as_json and as_csv:
        raise typer.BadParameter("only one of --json and --csv", param_hint="--csv")
    if as_json or as_csv:
        return Format.JSON if as_json else Format.CSV
    if out is None:
        return Format.TABLE
    try:
        return {".json": Format.JSON, ".csv": Format.CSV}[out.suffix.lower()]
    except KeyError:
        raise typer.BadParameter(f"{out} says no format; add --json or --csv", param_hint="--out") from None


def write_report(report: ScoreResponse, written: Format, out: Path | None) -> None:
    """Write a report to a file, or to standard output.

    Raises:
        CannotWrite: the file can't be written.
    """
    text = f"{report.model_dump_json(indent=2)}\n" if written is Format.JSON else _as_csv(report)
    if out is None:
        sys.stdout.write(text)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CannotWrite(f"{out} can't be written: {error.strerror}") from None


def show_table(report: ScoreResponse) -> None:
    """Show the summaries to a person."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = UNPIPED_WIDTH
    table = Table(caption=_caption(report), caption_justify="left")
    table.add_column("file", overflow="fold")
    for name in ("emotion", "level"):
        table.add_column(name)
    for name in ("mean", "peak", "last", "strong", "frames", "seconds"):
        table.add_column(name, justify="right")
    for scored in report.sequences:
        table.add_row(*_cells(scored))
    console.print(table)


def _cells(scored: SequenceScore) -> Iterator[str]:
    yield escape(scored.name)
    yield escape(scored.emotion)
    yield str(scored.level or "-")
    for value in (scored.intensity.mean, scored.intensity.peak, scored.intensity.last):
        yield "-" if value is None else f"{value:.3f}"
    yield f"{scored.strong:.0%}"
    yield str(scored.frames)
    yield f"{scored.duration_s:.1f}"


def _caption(report: ScoreResponse) -> str:
    lines = [f"model {report.model.name} {report.model.version}"]
    if report.model.purpose == "demo":
        lines[0] += " (demo: it shows how fervor runs, not science)"
    if any(scored.emotion == UNKNOWN for scored in report.sequences):
        lines.append("emotion unknown: how intense the movement is whatever it means; say it with --emotion")
    return escape("\n".join(lines))


def _as_csv(report: ScoreResponse) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    everything = any(scored.estimates is not None for scored in report.sequences)
    writer.writerow(FRAMES if everything else SUMMARY)
    for scored in report.sequences:
        writer.writerows(_frame_rows(scored) if everything else [_summary_row(scored)])
    return text.getvalue()


def _summary_row(scored: SequenceScore) -> tuple[object, ...]:
    intensity = (scored.intensity.mean, scored.intensity.peak, scored.intensity.last)
    return (
        scored.name,
        scored.emotion,
        scored.frames,
        scored.duration_s,
        *intensity,
        scored.strong,
        scored.level,
    )


def _frame_rows(scored: SequenceScore) -> Iterator[tuple[object, ...]]:
    for estimate in scored.estimates or ():
        yield (
            scored.name,
            estimate.seq,
            estimate.t,
            estimate.intensity,
            estimate.level,
            estimate.emotion,
            estimate.status,
            " ".join(estimate.flags),
        )
