"""Manifests: what every column may hold, and every problem told by its line at once."""

from pathlib import Path
from typing import Any

import pytest

from datasets import write_manifest
from fervor.errors import DataError
from fervor_export.data.label import Label
from fervor_export.data.listing import Listing
from fervor_export.data.manifest import list_manifest


def row(**cells: Any) -> dict[str, Any]:
    return {"file": "a.bvh", "emotion": "joy", "votes": "7/11", "actor": "Ann"} | cells


@pytest.fixture(autouse=True)
def files(tmp_path: Path) -> None:
    """Files that manifests name; nobody reads them here."""
    for name in ("a.bvh", "b.csv", "c.mvnx", "sub/a.bvh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()


def listed(tmp_path: Path, *rows: dict[str, Any]) -> Listing:
    return list_manifest(write_manifest(tmp_path, rows))


def problems(listing: Listing, severity: str = "unusable") -> list[str]:
    return [str(finding) for finding in listing.findings if finding.severity == severity]


def test_a_row_of_everything(tmp_path: Path) -> None:
    cells = {"file": "b.csv", "split": "Test", "skeleton": "Kinect-v2", "start": 1.5, "end": 4, "observers": 11}
    listing = listed(tmp_path, row(**cells, intensity=0.64))
    assert not listing.findings
    (entry,) = listing.entries
    assert entry.label == Label("joy", 7 / 11, 7, 11)
    assert (entry.split, entry.skeleton, entry.start_s, entry.end_s) == ("test", "kinect_v2", 1.5, 4.0)
    assert entry.file == tmp_path / "b.csv"


def test_an_intensity_may_say_of_how_many_observers(tmp_path: Path) -> None:
    listing = listed(
        tmp_path, row(votes="", intensity="0.25"), row(file="sub/a.bvh", votes="", intensity=1, observers=5)
    )
    assert [entry.label for entry in listing.entries] == [Label("joy", 0.25), Label("joy", 1.0, None, 5)]
    assert [entry.name for entry in listing.entries] == ["a", "sub/a"]


@pytest.mark.parametrize(
    ("cells", "what"),
    [
        ({"file": ""}, "file is empty"),
        ({"file": "lost.bvh"}, "there is no file"),
        ({"emotion": "contempt"}, "'contempt'"),
        ({"emotion": ""}, "emotion ''"),
        ({"actor": ""}, "actor is empty"),
        ({"votes": "12/11"}, "votes are 12/11"),
        ({"votes": "many"}, "'many'"),
        ({"votes": ""}, "neither votes nor an intensity"),
        ({"votes": "", "intensity": "70"}, "intensity is 70"),
        ({"votes": "", "intensity": "0,7"}, "'0,7'"),
        ({"votes": "", "intensity": "nan"}, "'nan'"),
        ({"intensity": "0.2"}, "expected them to agree"),
        ({"observers": "12"}, "expected the same number"),
        ({"observers": "some"}, "'some'"),
        ({"split": "dev"}, "'dev'"),
        ({"skeleton": "kinect_v2"}, "bring their own skeleton"),
        ({"file": "b.csv", "skeleton": "kinect_v9"}, "'kinect_v9'"),
        ({"start": "-1"}, "start is -1"),
        ({"start": "soon"}, "'soon'"),
        ({"start": "3", "end": "2"}, "the end after the start"),
    ],
)
def test_a_cell_that_cannot_be_used(tmp_path: Path, cells: dict[str, Any], what: str) -> None:
    listing = listed(tmp_path, row(**cells))
    assert not listing.entries
    (problem,) = problems(listing)
    assert problem.startswith("line 2 (")
    assert what in problem


def test_all_problems_of_all_rows_are_told_at_once(tmp_path: Path) -> None:
    listing = listed(tmp_path, row(actor="", emotion="x", votes="9"), row(), row(file="lost.bvh", split="dev"))
    assert [problem.partition(" (")[0] for problem in problems(listing)] == ["line 2"] * 3 + ["line 4"] * 2
    assert len(listing.entries) == 1


def test_rows_of_another_width_are_told(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("file,emotion,votes,actor\na.bvh,joy,7/11,Ann,more\n\na.bvh,joy,7/11\n")
    found = problems(list_manifest(tmp_path / "m.csv"))
    assert found[0].startswith("line 2 (a.bvh): 5 cells")
    assert found[1].startswith("line 4 (a.bvh): 3 cells")


def test_semicolons_and_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_bytes("\ufeffFile; Emotion;Votes;Actor\na.bvh;Happy;7/11;Jörg\n".encode())
    (entry,) = list_manifest(tmp_path / "m.csv").entries
    assert (entry.actor, entry.emotion) == ("Jörg", "joy")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_tables_as_windows_writes_them(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "m.csv").write_bytes("file;emotion;votes;actor\r\na.bvh;joy;7/11;Jörg\r\n".encode(encoding))
    (entry,) = list_manifest(tmp_path / "m.csv").entries
    assert entry.actor == "Jörg"


def test_clips_of_one_file_are_one_recording(tmp_path: Path) -> None:
    listing = listed(tmp_path, row(start=0, end=2), row(start=2, end=4, emotion="anger"))
    assert [entry.name for entry in listing.entries] == ["a", "a"]
    assert not listing.findings


@pytest.mark.parametrize(
    ("second", "what"),
    [
        ({"actor": "Ben"}, "the actor is Ben, but Ann in line 2"),
        ({"split": "test"}, "the split is test, but train in line 2"),
        ({"emotion": "anger"}, "the same stretch"),
        ({"file": "./a.bvh"}, "the same stretch"),
    ],
)
def test_one_file_is_of_one_actor_and_in_one_split(tmp_path: Path, second: dict[str, Any], what: str) -> None:
    listing = listed(
        tmp_path, row(split="train"), row(split="train", **second) if "split" not in second else row(**second)
    )
    assert len(listing.entries) == 1
    assert what in problems(listing)[0]


@pytest.mark.parametrize("again", ["link.bvh", "copy.bvh"])
def test_a_link_or_a_copy_is_the_same_file(tmp_path: Path, again: str) -> None:
    (tmp_path / "a.bvh").write_text("some motion")
    (tmp_path / "link.bvh").symlink_to(tmp_path / "a.bvh")
    (tmp_path / "copy.bvh").write_text("some motion")
    first = row(split="train", start=0, end=2)
    listing = listed(tmp_path, first, row(file=again, split="test", start=2, end=4))
    assert "the split is test, but train in line 2" in problems(listing)[0]
    listing = listed(tmp_path, first, row(file=again, split="train", start=2, end=4))
    assert [entry.name for entry in listing.entries] == ["a", "a"]


def test_files_of_one_size_are_not_one_file(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("some motion")
    (tmp_path / "sub" / "a.bvh").write_text("more motion")
    listing = listed(tmp_path, row(split="train"), row(file="sub/a.bvh", actor="Ben", split="test"))
    assert [entry.name for entry in listing.entries] == ["a", "sub/a"]
    assert not listing.findings


def test_one_person_spelt_in_two_ways_is_one_person(tmp_path: Path) -> None:
    names = ("Zoë M", "zoë  m", "Zoe\u0308 M", "Zoe M")
    files = ("a.bvh", "b.csv", "c.mvnx", "sub/a.bvh")
    listing = listed(tmp_path, *(row(file=file, actor=actor) for file, actor in zip(files, names, strict=True)))
    assert [entry.actor for entry in listing.entries] == ["Zoë M", "Zoë M", "Zoë M", "Zoe M"]
    doubts = problems(listing, "doubt")
    assert len(doubts) == 2
    assert doubts[0] == "line 3 (b.csv): actor 'zoë  m' is taken for 'Zoë M'"


@pytest.mark.parametrize("name", ["x" * 5000 + ".bvh", "a\nb.bvh", "sub"])
def test_a_name_that_is_no_file_is_one_line_of_the_report(tmp_path: Path, name: str) -> None:
    (problem,) = problems(listed(tmp_path, row(file=name)))
    assert "\n" not in problem
    assert len(problem) < 600


def test_splits_that_share_a_person_are_told(tmp_path: Path) -> None:
    listing = listed(tmp_path, row(split="train"), row(file="b.csv", split="test"), row(file="c.mvnx", actor="Ben"))
    doubts = problems(listing, "doubt")
    assert any("actor Ann: is in the splits test, train" in doubt for doubt in doubts)
    assert any("1 of 3 rows have none" in doubt for doubt in doubts)
    assert len(listing.entries) == 3


def test_a_misspelt_column_is_told(tmp_path: Path) -> None:
    assert "'actro'" in problems(listed(tmp_path, row(actro="Ann")), "doubt")[0]
    with pytest.raises(DataError, match="no column actor, votes or intensity;"):
        listed(tmp_path, {"file": "a.bvh", "emotion": "joy", "actro": "Ann"})


def test_an_empty_manifest_is_told(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("file,emotion,votes,actor\n")
    assert "no row follows" in problems(list_manifest(tmp_path / "m.csv"))[0]
    (tmp_path / "n.csv").write_bytes(b"")
    with pytest.raises(DataError, match="no column file"):
        list_manifest(tmp_path / "n.csv")
