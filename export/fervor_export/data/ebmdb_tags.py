"""EBMDB, second layout: a scrape of the web site, one file of tags a recording.

`tags/tag_names.txt` names the values that stand in `tags/<id6>.txt`, one a line; motion is in `bvh/<id6>.bvh` or
`mvnx/<id6>.mvnx`.

Rules. The usual tags make no label: the perceived category is the most frequent answer, not how many gave it. So the
observers' answers must come from elsewhere: a tag `Responses`; or a table `responses.csv` with the columns id and
responses, and maybe actor; or the tags `Consistency` and `Observers`, which are enough where the perceived category is
the intended one. Nor do the tags say who moved: people of the same gender, handedness and native tongue whose ages
lie within a year of each other are taken for one, so that nobody can be two.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from fervor.errors import DataError
from fervor_export.data.ebmdb import DESCRIPTION, find_files, share_of
from fervor_export.data.label import Label, known_emotion, label_from_responses
from fervor_export.data.listing import Entry, Finding, Listing
from fervor_export.data.table import Row, read_table, read_text

NAMES = Path("tags") / "tag_names.txt"
TABLE = "responses.csv"

NO_LABEL = f"no answers of observers, so no intensity; expected a tag Responses, or a table {TABLE} (id, responses)"

Tags = Mapping[str, str]

_PERSON = ("gender", "handedness", "native_tongue")


class Person(NamedTuple):
    """What the tags say of who moved."""

    who: tuple[str, ...]
    age: int  # years; 0 where unknown


def list_tags(folder: Path) -> Listing:
    """What the second layout says. Recordings without a label are counted, but make no clips.

    Raises:
        DataError: the tags' names, or the table of responses, can't be read.
    """
    names = ["_".join(line.lower().split()) for line in _lines(folder / NAMES)]
    if missing := [name for name in ("id", "intended_emotion") if name not in names]:
        raise DataError(f"{folder / NAMES}: no {' nor '.join(missing)}; expected one name a line, such as ID")
    listing = Listing("ebmdb_tags", DESCRIPTION)
    files, asked = find_files(folder), _asked(folder)
    paths = [path for path in sorted((folder / "tags").glob("*.txt")) if path.name != NAMES.name]
    tags = {path.stem: _read_tags(path, names) for path in paths}
    people = _people(tags.values())
    for stem, row in tags.items():
        entry = _entry(listing, stem, row, files.get(stem), asked.get(_number(row.get("id", stem)), _NOBODY))
        if entry is not None:
            listing.entries.append(replace(entry, actor=entry.actor or people[_person(row)]))
    for stem in sorted(files.keys() - tags.keys()):
        listing.unusable(files[stem].name, f"no tags/{stem}.txt")
    _tell_what_is_missing(listing, asked)
    return listing


def _entry(listing: Listing, stem: str, tags: Tags, path: Path | None, asked: Row) -> Entry | None:
    """The entry of one file of tags, its actor empty where nobody says it; None where there is none."""
    where = f"tags/{stem}.txt"
    if path is None:
        listing.unusable(where, f"no file bvh/{stem}.bvh nor mvnx/{stem}.mvnx")
        return None
    try:
        emotion = known_emotion(tags.get("intended_emotion", ""))
        label = _label(emotion, tags, asked["responses"])
    except DataError as error:
        listing.unusable(where, error.message)
        return None
    if label is None:
        listing.unusable(where, NO_LABEL)
    return Entry(where, path, stem, asked["actor"], emotion, label)


def _label(emotion: str, tags: Tags, responses: str) -> Label | None:
    """The label, if anything makes one."""
    if answers := responses or tags.get("responses", ""):
        return label_from_responses(emotion, answers)
    share = share_of(tags.get("consistency", ""))
    observers = _number(tags.get("observers", ""))
    if share is None or not observers.isdigit() or known_emotion(tags.get("perceived_category", "")) != emotion:
        return None
    votes = round(share * int(observers))
    return Label(emotion, votes / int(observers), votes, int(observers))


def _tell_what_is_missing(listing: Listing, asked: Mapping[str, Row]) -> None:
    """What concerns all recordings, said once."""
    without = [finding for finding in listing.findings if finding.what == NO_LABEL]
    if without and len(without) == len(listing.entries):
        others = [finding for finding in listing.findings if finding.what != NO_LABEL]
        listing.findings = [Finding("unusable", str(NAMES), NO_LABEL), *others]
    if listing.entries and not all(row["actor"] for row in asked.values() or [_NOBODY]):
        people = len({entry.actor for entry in listing.entries})
        listing.doubt(
            str(NAMES), f"no tag says who moved; gender, age, handedness and tongue tell {people} people apart"
        )


_NOBODY = Row(0, {}, 0)


def _asked(folder: Path) -> dict[str, Row]:
    """Rows of the table of responses by their id, if there is one."""
    path = folder / TABLE
    if not path.is_file():
        return {}
    table = read_table(path)
    if missing := table.missing("id", "responses"):
        raise DataError(f"{path}: no column {', '.join(missing)}; expected id and responses")
    return {_number(row["id"]): row for row in table.rows}


def _people(rows: Iterable[Tags]) -> dict[Person, str]:
    """A name for whoever has the same gender, handedness, tongue and, within a year, age."""
    ages: defaultdict[tuple[str, ...], set[int]] = defaultdict(set)
    for row in rows:
        person = _person(row)
        ages[person.who].add(person.age)
    names: dict[Person, str] = {}
    for who, known in ages.items():
        first = before = min(known)
        for age in sorted(known):
            first = age if age > before + 1 else first
            said = [*filter(None, who), *([str(first)] if first else [])]
            names[Person(who, age)] = ", ".join(said) or "unknown"
            before = age
    return names


def _person(row: Tags) -> Person:
    age = row.get("age", "")
    return Person(tuple(row.get(name, "").lower() for name in _PERSON), int(age) if age.isdecimal() else 0)


def _read_tags(path: Path, names: list[str]) -> Tags:
    """Values by their names; what is too much belongs to the last one, the text."""
    values = _lines(path)
    if len(values) > len(names):
        values = [*values[: len(names) - 1], " ".join(values[len(names) - 1 :])]
    return dict(zip(names, values, strict=False))


def _number(text: str) -> str:
    """A number without leading zeros and decimals, so that 7, 000007 and 7.0 are one."""
    return text.strip().removesuffix(".0").lstrip("0")


def _lines(path: Path) -> list[str]:
    """Lines of a text file, stripped; empty ones at the end are dropped."""
    return [line.strip() for line in read_text(path).rstrip().splitlines()]
