"""EBMDB's first layout: labels, actors, and every planted fault told."""

from pathlib import Path

import pytest

import datasets
from datasets import EBMDB_TABLE, Take, ebmdb_rows, takes, write_ebmdb, write_table
from fervor.errors import DataError
from fervor_export.data.ebmdb import find_files, list_ebmdb
from fervor_export.data.ebmdb_names import NameParts, parts_of, usual_code
from fervor_export.data.listing import Listing


def test_file_names_say_actor_emotion_and_length() -> None:
    assert parts_of("AnBh_0208_ftf_wd_t3-002_91_560809_563542_2733_Anger") == NameParts("AnBh", "anger", 2.733)
    assert parts_of("DiMi_0709_ft_ch_t1_anger_07830-08215") == NameParts("DiMi", "anger", 385 / 120)
    assert parts_of("SiGl_nv_al_shame_21275-21992").actor == "SiGl"
    assert parts_of("AnBh_walk_1_2_3_Contempt") == NameParts("AnBh", None, 0.003)
    assert parts_of("000001") == NameParts(None, None, None)


def test_a_column_of_actors_may_hold_codes_or_other_names() -> None:
    assert usual_code([("AnBh", "AnBh"), ("AnBh", "DiMi"), ("AnBh", "DiMi")]) == {"AnBh": "AnBh"}
    assert usual_code([("1", "AnBh"), ("1", "AnBh"), ("1", "DiMi"), (None, "DiMi")]) == {"1": "AnBh"}


def listed(tmp_path: Path, rows: list[dict[str, str]]) -> Listing:
    write_table(tmp_path / EBMDB_TABLE, rows)
    return list_ebmdb(tmp_path)


def said(listing: Listing, severity: str = "unusable") -> list[str]:
    return [str(finding) for finding in listing.findings if finding.severity == severity]


@pytest.fixture
def made(tmp_path: Path) -> list[Take]:
    """Takes whose files are there, but empty: listing reads none."""
    made = takes(6)
    (tmp_path / "bvh").mkdir()
    for take in made:
        (tmp_path / "bvh" / f"{take.name}.bvh").touch()
    return made


@pytest.mark.parametrize("separator", [" ", ", ", ";", "|"])
def test_labels_are_counted_from_the_responses(tmp_path: Path, made: list[Take], separator: str) -> None:
    listing = listed(tmp_path, ebmdb_rows(made, separator=separator))
    assert not listing.findings
    for entry, take in zip(listing.entries, made, strict=True):
        assert entry.label is not None
        assert (entry.actor, entry.emotion, entry.name) == (take.actor, take.emotion, take.name)
        assert (entry.label.votes, entry.label.observers) == (take.votes, datasets.OBSERVERS)
        assert entry.told_s == pytest.approx(take.seconds, abs=1e-9)


def test_a_column_without_a_name_and_another_table_name_do_no_harm(tmp_path: Path, made: list[Take]) -> None:
    write_table(tmp_path / "metadata.csv", ebmdb_rows(made), index=True)
    assert len(list_ebmdb(tmp_path).entries) == len(made)


def test_rows_without_files_and_files_without_rows_are_told(tmp_path: Path, made: list[Take]) -> None:
    lost = takes(1, actors=("HeGa",), seed=9)
    (tmp_path / "bvh" / "LeSt_0101_x_t1_joy_00000-00180.bvh").touch()
    listing = listed(tmp_path, ebmdb_rows([*made, *lost]))
    assert len(listing.entries) == len(made)
    first, second = said(listing)
    assert lost[0].name in first
    assert "no file" in first
    assert second.startswith("LeSt_0101_x_t1_joy_00000-00180.bvh: no row")


def test_files_known_to_be_bad_are_skipped_and_said(tmp_path: Path, made: list[Take]) -> None:
    bad = Take("SiGl_nv_al_shame_21275-21992", "shame", "SiGl", 4, 1)
    (tmp_path / "bvh" / f"{bad.name}.bvh").touch()
    (tmp_path / "bvh" / "PaPi_0509_nv_al_t2_sadness_15737-16254.bvh").touch()
    listing = listed(tmp_path, ebmdb_rows([bad, *made]))
    assert len(listing.entries) == len(made)
    assert not said(listing)
    assert len(said(listing, "skipped")) == 2


def test_every_planted_fault_is_told_at_once(tmp_path: Path, made: list[Take]) -> None:
    rows = ebmdb_rows(made)
    rows[0]["responses"] = ""
    rows[1]["intended_emotion"] = "contempt"
    rows[2]["actor"] = "DiMi"  # the file name says AnBh
    rows.append(dict(rows[3]))
    rows.append(rows[3] | {"motion_id": ""})
    listing = listed(tmp_path, rows)
    found = said(listing)
    assert len(found) == 5
    for fault in (
        "no responses",
        "'contempt'",
        "the file name says AnBh",
        "has stood in the table",
        "motion_id is empty",
    ):
        assert sum(fault in one for one in found) == 1, fault
    assert len(listing.entries) == len(made) - 3
    assert all(finding.where.startswith("line ") for finding in listing.findings)


def test_names_of_actors_must_go_with_one_code_each(tmp_path: Path, made: list[Take]) -> None:
    rows = [row | {"actor": "one" if row["actor"] == "AnBh" else "two"} for row in ebmdb_rows(made)]
    assert {entry.actor for entry in listed(tmp_path, rows).entries} == {"AnBh", "DiMi"}
    rows[0]["actor"] = "two"
    assert "elsewhere DiMi" in said(listed(tmp_path, rows))[0]


def test_doubts_are_told_but_used(tmp_path: Path, made: list[Take]) -> None:
    rows = ebmdb_rows(made)
    rows[0]["consistency"] = "0.99"
    rows[1]["modal_category"] = next(name for name in ("pride", "shame") if name not in rows[1]["responses"].split())
    rows[2]["intended_emotion"] = "pride"
    listing = listed(tmp_path, rows)
    assert len(listing.entries) == len(made)
    doubts = said(listing, "doubt")
    assert len(doubts) == 3
    assert any("consistency is 0.99" in doubt for doubt in doubts)
    assert any("modal_category" in doubt for doubt in doubts)
    assert any("the file name says disgust" in doubt for doubt in doubts)


def test_a_column_that_means_something_else_is_told_once(tmp_path: Path) -> None:
    made = takes(24)
    (tmp_path / "bvh").mkdir()
    for take in made:
        (tmp_path / "bvh" / f"{take.name}.bvh").touch()
    rows = [row | {"consistency": "0.1"} for row in ebmdb_rows(made)]
    doubts = said(listed(tmp_path, rows), "doubt")
    assert len(doubts) == 1
    assert "must mean something else" in doubts[0]


def test_responses_in_other_words_are_not_taken_for_zeros(tmp_path: Path, made: list[Take]) -> None:
    listing = listed(tmp_path, [row | {"responses": "Wut Freude Scham"} for row in ebmdb_rows(made)])
    assert not listing.entries
    assert listing.findings[0].where == "column responses"


def test_a_table_without_a_label_is_refused(tmp_path: Path, made: list[Take]) -> None:
    rows = [{key: value for key, value in row.items() if key != "responses"} for row in ebmdb_rows(made)]
    with pytest.raises(DataError, match="no column responses"):
        listed(tmp_path, rows)


def test_bvh_goes_before_mvnx(tmp_path: Path) -> None:
    for name in ("bvh/a.bvh", "mvnx/a.mvnx", "mvnx/b.mvnx"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert {stem: path.suffix for stem, path in find_files(tmp_path).items()} == {"a": ".bvh", "b": ".mvnx"}


def test_write_ebmdb_writes_what_the_layout_says(tmp_path: Path) -> None:
    write_ebmdb(tmp_path, takes(1))
    text = next((tmp_path / "bvh").iterdir()).read_text()
    assert text.count("CHANNELS") == 23
    assert len(text.splitlines()[-1].split()) == 72
