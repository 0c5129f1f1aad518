"""EBMDB, first layout: a metadata table and `bvh/<motion_id>.bvh`.

Rules. The label is counted from `responses`; `consistency` (the share of the most frequent answer) is checked against
it. The actor is the code at the beginning of the file name; the column `actor` must agree with it, by the same code or
by a name of its own for each. Rows without a file, files without a row, and what disagrees are told, all of them. The
table has been seen with and without an unnamed first column, and with 1,447 and 1,451 rows.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fervor.errors import DataError
from fervor_export.data.ebmdb_names import KNOWN_BAD, parts_of, usual_code
from fervor_export.data.label import Label, count_answers, known_emotion, label_from_responses
from fervor_export.data.listing import Entry, Finding, Listing
from fervor_export.data.table import Row, read_table

TABLE = "emotional_body_motion_database_metadata.csv"
"""The table's usual name."""

DESCRIPTION = "motion in EBMDB's layout (Volkova et al., PLoS ONE 9(12):e113647, 2014)"
"""Not "EBMDB": the layout says nothing of where files come from."""

NEEDED = ("motion_id", "intended_emotion", "responses")
"""Columns without which there is no label."""

SUFFIXES = (".bvh", ".mvnx")
"""Kinds of files, the one to take first; each lies in a folder of its name."""


def find_metadata(folder: Path) -> Path | None:
    """The metadata table of a folder, by its name or by its columns."""
    usual = folder / TABLE
    if usual.is_file():
        return usual
    return next((path for path in sorted(folder.glob("*.csv")) if _fits(path)), None)


def _fits(path: Path) -> bool:
    try:
        return not read_table(path).missing(*NEEDED)
    except DataError:
        return False


def list_ebmdb(folder: Path) -> Listing:
    """What the first layout says.

    Raises:
        DataError: no table, or one without the columns that a label needs.
    """
    path = find_metadata(folder)
    if path is None:
        raise DataError(f"{folder}: no {TABLE}; expected EBMDB's table beside its folder bvh")
    table = read_table(path)
    if missing := table.missing(*NEEDED):
        raise DataError(f"{path}: no column {', '.join(missing)}; expected those of EBMDB's table")
    listing = Listing("ebmdb", DESCRIPTION)
    files = find_files(folder)
    _list_rows(listing, table.rows, files)
    _list_unnamed(listing, {_bare(row["motion_id"]) for row in table.rows}, files, path)
    if listing.entries and not any(entry.label and entry.label.votes for entry in listing.entries):
        what = "no answer in it is ever the intended emotion; expected the names of emotions"
        listing.findings.insert(0, Finding("unusable", "column responses", what))
        listing.entries.clear()
    return listing


def find_files(folder: Path) -> dict[str, Path]:
    """The motion files of a folder by their stems; of two kinds of one recording, the first of `SUFFIXES`."""
    found: dict[str, Path] = {}
    for suffix in SUFFIXES:
        inside = folder / suffix[1:]
        for path in sorted((inside if inside.is_dir() else folder).iterdir()):
            if path.suffix.lower() == suffix:
                found.setdefault(path.stem, path)
    return found


def _list_rows(listing: Listing, rows: Sequence[Row], files: Mapping[str, Path]) -> None:
    """Entries of all rows that can be used; findings of the others."""
    by_lower = {stem.lower(): path for stem, path in files.items()}
    codes = usual_code((row["actor"], parts_of(_bare(row["motion_id"])).actor) for row in rows)
    seen: set[str] = set()
    odd: list[Finding] = []
    for row in rows:
        name = _bare(row["motion_id"])
        where = f"line {row.line} ({name or 'no motion_id'})"
        path = files.get(name) or by_lower.get(name.lower())
        if name in KNOWN_BAD:
            listing.skip(where, "is known to be broken")
        elif not name:
            listing.unusable(where, "motion_id is empty")
        elif name.lower() in seen:
            listing.unusable(where, "this motion_id has stood in the table before")
        elif path is None:
            listing.unusable(where, f"no file {name}.bvh")
        elif _list_row(listing, row, where, path, codes):
            odd += _oddities(row, where)
        seen.add(name.lower())
    _tell_oddities(listing, odd)


def _list_row(listing: Listing, row: Row, where: str, path: Path, codes: Mapping[str, str]) -> bool:
    """The entry of one row that has a file; False where there can be none."""
    told, column = parts_of(path.stem), row["actor"]
    actor = told.actor or column
    try:
        label = label_from_responses(row["intended_emotion"], row["responses"])
    except DataError as error:
        listing.unusable(where, error.message)
        return False
    if not actor:
        listing.unusable(where, "neither the file name nor a column actor says who moved")
        return False
    if told.actor and codes.get(column, told.actor) != told.actor:
        listing.unusable(where, f"the column actor says {_said(column, codes)}, the file name says {told.actor}")
        return False
    if told.emotion and told.emotion != label.emotion:
        listing.doubt(where, f"intended_emotion is {label.emotion}; the file name says {told.emotion}")
    listing.entries.append(_entry(where, path, actor, label, told.seconds))
    return True


def _said(column: str, codes: Mapping[str, str]) -> str:
    return column if codes[column] == column else f"{column}, elsewhere {codes[column]}"


def _entry(where: str, path: Path, actor: str, label: Label, seconds: float | None) -> Entry:
    return Entry(where, path, path.stem, actor, label.emotion, label, told_s=seconds)


def _list_unnamed(listing: Listing, named: set[str], files: Mapping[str, Path], table: Path) -> None:
    """Findings of files that no row names."""
    lower = {name.lower() for name in named}
    for stem, path in sorted(files.items()):
        if stem in KNOWN_BAD and stem not in named:
            listing.skip(path.name, "is known to be broken")
        elif stem.lower() not in lower:
            listing.unusable(path.name, f"no row of {table.name} names this file")


def _oddities(row: Row, where: str) -> list[Finding]:
    """Where `consistency` or `modal_category` is not that of the responses: then one of them is wrong."""
    found = []
    counts = count_answers(row["responses"])
    total, most = counts.total(), max(counts.values())
    share = share_of(row["consistency"])
    if share is not None and abs(share - most / total) > 0.02:
        found.append(Finding("doubt", where, f"consistency is {share:.2f}, but {most} of {total} responses agree"))
    try:
        modal = known_emotion(row["modal_category"])
    except DataError:
        return found  # empty, or no emotion: some clips have no single mode
    if counts[modal] < most:
        what = f"modal_category is {modal}, but {counts[modal]} of {total} responses are, {most} another"
        found.append(Finding("doubt", where, what))
    return found


def _tell_oddities(listing: Listing, odd: Sequence[Finding]) -> None:
    """All of them, unless they are so many that a column must mean something else."""
    for column in ("consistency", "modal_category"):
        found = [finding for finding in odd if finding.what.startswith(column)]
        if len(found) > 10 and 2 * len(found) > len(listing.entries):
            what = f"disagrees with the responses in {len(found)} rows, so it must mean something else"
            listing.doubt(f"column {column}", what)
        else:
            listing.findings += found


def share_of(text: str) -> float | None:
    """A share from 0 to 1, also where it is written in per cent; None for anything else."""
    try:
        value = float(text.rstrip("%").replace(",", "."))
    except ValueError:
        return None
    value = value / 100.0 if value > 1.0 else value
    return value if 0.0 <= value <= 1.0 else None


def _bare(motion_id: str) -> str:
    """A motion_id without the folder and suffix that some tables give it."""
    name = motion_id.rpartition("/")[2]
    return name[:-4] if name.lower().endswith(".bvh") else name
