"""EBMDB's second layout: what makes a label, who is who, and what is said where nothing does."""

from pathlib import Path

import pytest

from datasets import PEOPLE, Take, takes, write_table, write_tags
from fervor.errors import DataError
from fervor_export.data.ebmdb_tags import NO_LABEL, list_tags


def rewrite(folder: Path, number: int, **lines: str) -> None:
    """Change values of a file of tags by their place in `tag_names.txt`."""
    names = (folder / "tags" / "tag_names.txt").read_text().splitlines()
    path = folder / "tags" / f"{number:06}.txt"
    values = path.read_text().splitlines()
    for name, value in lines.items():
        values[names.index(name.replace("_", " "))] = value
    path.write_text("\n".join(values) + "\n")


@pytest.fixture
def made(tmp_path: Path) -> list[Take]:
    made = takes(4, seconds=0.2)
    write_tags(tmp_path, made, responses=True, mvnx=(1,))
    return made


def test_a_tag_of_responses_makes_labels(tmp_path: Path, made: list[Take]) -> None:
    listing = list_tags(tmp_path)
    assert not [finding for finding in listing.findings if finding.severity == "unusable"]
    for entry, take in zip(listing.entries, made, strict=True):
        assert entry.label is not None
        assert (entry.emotion, entry.label.votes, entry.label.observers) == (take.emotion, take.votes, 11)
    assert [entry.file.suffix for entry in listing.entries] == [".bvh", ".mvnx", ".bvh", ".bvh"]


def test_the_usual_tags_make_no_label_and_that_is_said_once(tmp_path: Path) -> None:
    write_tags(tmp_path, takes(3, seconds=0.2))
    listing = list_tags(tmp_path)
    assert [str(finding) for finding in listing.findings if finding.severity == "unusable"] == [
        f"{Path('tags') / 'tag_names.txt'}: {NO_LABEL}"
    ]
    assert [entry.label for entry in listing.entries] == [None] * 3


def test_a_table_of_responses_makes_labels_and_actors(tmp_path: Path) -> None:
    made = takes(3, seconds=0.2)
    write_tags(tmp_path, made)
    rows = [
        {"ID": str(place), "responses": ";".join(take.answers), "actor": take.actor}
        for place, take in enumerate(made, start=1)
    ]
    write_table(tmp_path / "responses.csv", rows)
    listing = list_tags(tmp_path)
    assert not listing.findings
    assert [(entry.actor, entry.label and entry.label.votes) for entry in listing.entries] == [
        (take.actor, take.votes) for take in made
    ]


def test_consistency_is_enough_where_the_perceived_emotion_is_the_intended_one(tmp_path: Path) -> None:
    write_tags(tmp_path, takes(2, seconds=0.2))
    names = tmp_path / "tags" / "tag_names.txt"
    names.write_text(names.read_text() + "Consistency\nObservers\n")
    for number, perceived in ((1, "amusement"), (2, "joy")):
        path = tmp_path / "tags" / f"{number:06}.txt"
        path.write_text(path.read_text() + "0.636\n11\n")
        rewrite(tmp_path, number, Perceived_category=perceived)
    first, second = list_tags(tmp_path).entries
    assert first.label is not None
    assert (first.label.votes, first.label.observers) == (7, 11)
    assert second.label is None


def test_people_are_told_apart_by_what_is_said_of_them(tmp_path: Path) -> None:
    made = takes(4, actors=tuple(PEOPLE), seconds=0.2)
    write_tags(tmp_path, made, responses=True)
    assert len({entry.actor for entry in list_tags(tmp_path).entries}) == 4
    rewrite(tmp_path, 3, Age="25")  # the other woman had a birthday: nobody may be two people
    entries = list_tags(tmp_path).entries
    assert entries[0].actor == entries[2].actor
    assert any("who moved" in finding.what for finding in list_tags(tmp_path).findings)


def test_faults_are_told(tmp_path: Path, made: list[Take]) -> None:
    (tmp_path / "bvh" / "000001.bvh").unlink()
    (tmp_path / "bvh" / "000099.bvh").touch()
    rewrite(tmp_path, 3, Intended_emotion="contempt")
    (tmp_path / "tags" / "000004.txt").write_text("000004\n")
    found = [str(finding) for finding in list_tags(tmp_path).findings if finding.severity == "unusable"]
    assert len(found) == 4
    for fault in ("tags/000001.txt: no file", "000099.bvh: no tags", "'contempt'", "tags/000004.txt: emotion ''"):
        assert any(fault in one for one in found), fault


def test_names_of_tags_are_needed(tmp_path: Path, made: list[Take]) -> None:
    (tmp_path / "tags" / "tag_names.txt").write_text("a\nb\n")
    with pytest.raises(DataError, match="no id nor intended_emotion"):
        list_tags(tmp_path)
    (tmp_path / "tags" / "tag_names.txt").unlink()
    with pytest.raises(DataError, match="can't be read"):
        list_tags(tmp_path)
