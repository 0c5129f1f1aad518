"""A manifest: a CSV table that says of any motion files what they show, how intensely, and who moved.

    file,emotion,votes,actor,split,skeleton,start,end
    ann/joy_01.bvh,joy,7/11,Ann,train,,,
    ben/joy_01.csv,joy,3/11,Ben,test,kinect_v2,2.5,6.0

Rules. `file`, `emotion`, `actor`, and `votes` (k/n) or `intensity` (0 to 1) are needed; `observers` is n beside an
intensity. Paths are relative to the manifest. All that is wrong is told at once, by line. Clips cut from one file are
one recording: they may not be of two actors, nor in two splits. So are clips of a file and of its copy or a link to it.
Names of actors that differ in case or blanks alone are one person's.
"""

import math
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from hashlib import file_digest
from pathlib import Path
from typing import TypeVar

from fervor.errors import DataError, InputError
from fervor.recordings.reader import SUFFIXES
from fervor.skeletons.catalog import source
from fervor_export.data.label import Label, known_emotion, label_from_votes
from fervor_export.data.listing import Entry, Listing
from fervor_export.data.table import Row, Table, read_table

NEEDED = ("file", "emotion", "actor")
OPTIONAL = ("votes", "intensity", "observers", "split", "skeleton", "start", "end")
SPLITS = ("train", "validation", "test")

NAME = "manifest.csv"
"""What a manifest is called in a folder that is given instead of it."""

LONGEST_SHOWN = 160
"""Letters of a name in messages."""

T = TypeVar("T")


def list_manifest(path: Path) -> Listing:
    """What a manifest says.

    Raises:
        DataError: it can't be read as a table, or columns are missing.
    """
    table = read_table(path)
    missing = table.missing(*NEEDED)
    if len(table.missing("votes", "intensity")) == 2:
        missing.append("votes or intensity")
    if missing:
        raise DataError(
            f"{path}: no column {', '.join(missing)}; expected file, emotion, actor, and votes or intensity"
        )
    listing = Listing("manifest", f"manifest {path.name}")
    for column in table.columns:
        if column not in (*NEEDED, *OPTIONAL):
            listing.doubt("line 1", f"the column {column!r} has no meaning here and is not used")
    for row in table.rows:
        _list_row(listing, row, table, path.parent)
    _name_actors_alike(listing)
    _check_files(listing)
    _check_actors(listing)
    if not table.rows:
        listing.unusable("line 1", "no row follows; expected one for each clip")
    return listing


def _list_row(listing: Listing, row: Row, table: Table, folder: Path) -> None:
    """The entry of one row, or all that is wrong with it."""
    where = f"line {row.line} ({_shown(row['file']) or 'no file'})"
    problems: list[str] = []

    def tried(read: Callable[[Row], T]) -> T | None:
        try:
            return read(row)
        except InputError as error:
            problems.append(error.message)
            return None

    if row.width != len(table.columns):
        problems.append(f"{row.width} cells; expected {len(table.columns)} as in the column names")
    file = tried(lambda row: _file(row, folder))
    emotion = tried(lambda row: known_emotion(row["emotion"]))
    label = tried(lambda row: _label(row, emotion or "neutral"))
    actor, split, skeleton = tried(_actor), tried(_split), tried(_skeleton)
    start, end = tried(lambda row: _seconds(row, "start")), tried(lambda row: _seconds(row, "end"))
    if start is not None and end is not None and end <= start:
        problems.append(f"it ends at {end:g} s and starts at {start:g} s; expected the end after the start")
    for problem in problems:
        listing.unusable(where, problem)
    if not problems and file and emotion and actor:
        name = Path(row["file"]).with_suffix("").as_posix()
        listing.entries.append(Entry(where, file, name, actor, emotion, label, split, skeleton, start, end))


# --- cells ------------------------------------------------------------------------------------------------------------


def _file(row: Row, folder: Path) -> Path:
    if not row["file"]:
        raise DataError("file is empty; expected a path relative to the manifest")
    path = folder / row["file"]
    try:
        found = path.is_file()
    except OSError as error:  # a name that is too long, a folder that is closed to us
        raise DataError(f"{_shown(str(path))}: can't be read: {error.strerror or error}") from error
    if not found:
        raise DataError(f"there is no file {_shown(str(path))}" + (", it is a folder" if path.is_dir() else ""))
    return path


def _actor(row: Row) -> str:
    if not row["actor"]:
        raise DataError("actor is empty; expected who moved, for folds must never split a person")
    return row["actor"]


def _label(row: Row, emotion: str) -> Label:
    """The label of votes or intensity; where both are given they must agree."""
    votes = label_from_votes(emotion, row["votes"]) if row["votes"] else None
    observers = _observers(row)
    if votes and observers not in (None, votes.observers):
        raise DataError(f"votes are {row['votes']} but observers {observers}; expected the same number")
    if not row["intensity"]:
        if votes is None:
            raise DataError("neither votes nor an intensity; expected one of them")
        return votes
    intensity = _number(row["intensity"], "intensity")
    if not 0.0 <= intensity <= 1.0:
        raise DataError(f"intensity is {row['intensity']}; expected a number from 0 to 1")
    if votes:
        if abs(votes.intensity - intensity) > 0.01:
            raise DataError(f"votes are {row['votes']} but intensity {row['intensity']}; expected them to agree")
        return votes
    return Label(emotion, intensity, None, observers)


def _observers(row: Row) -> int | None:
    if not row["observers"]:
        return None
    if not row["observers"].isdecimal() or int(row["observers"]) < 1:
        raise DataError(f"observers are {row['observers']!r}; expected a whole number from 1")
    return int(row["observers"])


def _split(row: Row) -> str | None:
    split = row["split"].lower() or None
    if split not in (None, *SPLITS):
        raise DataError(f"split is {row['split']!r}; expected {', '.join(SPLITS)} or nothing")
    return split


def _skeleton(row: Row) -> str | None:
    if not row["skeleton"]:
        return None
    kind = SUFFIXES.get(Path(row["file"]).suffix.lower())
    if kind in ("bvh", "mvnx"):
        raise DataError(f"{kind.upper()} files bring their own skeleton; expected none")
    return source(row["skeleton"]).name


def _seconds(row: Row, column: str) -> float | None:
    if not row[column]:
        return None
    seconds = _number(row[column], column)
    if seconds < 0.0:
        raise DataError(f"{column} is {row[column]}; expected seconds from 0")
    return seconds


def _number(text: str, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{column} is {text!r}; expected a number, with a point for decimals")
    return value


def _shown(name: str) -> str:
    """A name for messages: on one line, and not without end."""
    printable = "".join(letter if letter.isprintable() else " " for letter in name)
    return printable if len(printable) <= LONGEST_SHOWN else f"{printable[:LONGEST_SHOWN]}…"


# --- rows together ----------------------------------------------------------------------------------------------------


def _name_actors_alike(listing: Listing) -> None:
    """One spelling for names that differ in case, blanks or Unicode form only: the first."""
    first: dict[str, str] = {}
    told = set()
    for place, entry in enumerate(listing.entries):
        name = first.setdefault("".join(unicodedata.normalize("NFKC", entry.actor).casefold().split()), entry.actor)
        if name != entry.actor:
            if entry.actor not in told:
                listing.doubt(entry.where, f"actor {entry.actor!r} is taken for {name!r}")
            told.add(entry.actor)
            listing.entries[place] = replace(entry, actor=name)


def _check_files(listing: Listing) -> None:
    """One file, one actor and one split; the same stretch only once. What breaks this is left out."""
    paths = {entry.file: entry.file.resolve() for entry in listing.entries}
    whole = _originals(paths.values())
    by_content: defaultdict[Path, list[Entry]] = defaultdict(list)
    for entry in listing.entries:
        by_content[whole[paths[entry.file]]].append(entry)
    kept = []
    for entry in listing.entries:
        same = by_content[whole[paths[entry.file]]]
        if _fits(listing, entry, same):
            kept.append(replace(entry, name=same[0].name))
    listing.entries = kept


def _originals(paths: Iterable[Path]) -> dict[Path, Path]:
    """Each file's first one with the same bytes; only files of one size are read. Empty files are all their own."""
    by_size: defaultdict[int, list[Path]] = defaultdict(list)
    for path in dict.fromkeys(paths):
        by_size[path.stat().st_size].append(path)
    first: dict[Path, Path] = {}
    for size, same in by_size.items():
        known: dict[bytes, Path] = {}
        for path in same:
            alone = len(same) == 1 or not size
            first[path] = path if alone else known.setdefault(_sha256(path), path)
    return first


def _sha256(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return file_digest(stream, "sha256").digest()
    except OSError:
        return str(path).encode()  # told when it is to be read


def _fits(listing: Listing, entry: Entry, same_file: Sequence[Entry]) -> bool:
    """Whether an entry fits those before it that are of the same file; a finding where it does not."""
    for other in same_file:
        if other is entry:
            return True
        if other.actor != entry.actor:
            listing.unusable(entry.where, f"the actor is {entry.actor}, but {other.actor} in {other.where}")
            return False
        if other.split != entry.split:
            splits = f"{entry.split or 'none'}, but {other.split or 'none'}"
            listing.unusable(entry.where, f"the split is {splits} in {other.where}; one file can't be in two")
            return False
        again = (other.file.resolve(), other.start_s, other.end_s) == (
            entry.file.resolve(), entry.start_s, entry.end_s,
        )  # fmt: skip
        if again:
            listing.unusable(entry.where, f"the same stretch of the same file as in {other.where}")
            return False
    return True


def _check_actors(listing: Listing) -> None:
    """Tells who is in several splits, and where only some rows have one."""
    splits: defaultdict[str, set[str]] = defaultdict(set)
    for entry in listing.entries:
        splits[entry.actor].add(entry.split or "none")
    for actor, found in sorted(splits.items()):
        if len(found) > 1:
            listing.doubt(f"actor {actor}", f"is in the splits {', '.join(sorted(found))}: they share a person")
    split = sum(entry.split is not None for entry in listing.entries)
    if 0 < split < len(listing.entries):
        listing.doubt("column split", f"{len(listing.entries) - split} of {len(listing.entries)} rows have none")
