"""Bones of BVH files: equal bodies are told, where bodies differ at all."""

from pathlib import Path

import pytest

import datasets
from fervor_export.data.bones import bones_of, shared_bones
from fervor_export.data.dataset import check_dataset


def grown(file: Path) -> Path:
    """The same file with longer forearms."""
    file.write_text(file.read_text().replace("OFFSET 0 -24 0", "OFFSET 0 -25.5 0"))
    return file


def test_files_of_one_body_share_a_word(tmp_path: Path) -> None:
    first = datasets.write_bvh(tmp_path / "a.bvh", datasets.motion(seconds=0.6))
    again = datasets.write_bvh(tmp_path / "b.bvh", datasets.motion(seconds=0.6, seed=1))
    other = grown(datasets.write_bvh(tmp_path / "c.bvh", datasets.motion(seconds=0.6)))
    assert bones_of(first) == bones_of(again) != bones_of(other)
    assert bones_of(datasets.write_npz(tmp_path / "d.npz", datasets.motion(seconds=0.6))) == ""


def test_nothing_is_said_where_everybody_has_one_body() -> None:
    assert shared_bones([("Ann", "x"), ("Ben", "x"), ("Cem", "")]) == []
    assert shared_bones([("Ann", "x"), ("Ben", "y"), ("Ann", "y")]) == [("Ann", "Ben")]
    assert shared_bones([("Ann", "x"), ("Ben", "y"), ("Ann", "x")]) == []


def test_one_person_under_two_names_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    rows = []
    for index, actor in enumerate(("Ann", "Ben", "Cem")):
        file = datasets.write_bvh(tmp_path / f"{actor}.bvh", datasets.motion(seconds=1.0, seed=index))
        if actor == "Cem":
            grown(file)
        rows.append({"file": file.name, "emotion": "joy", "votes": "3/5", "actor": actor})
    for _ in ("cold", "from the cache"):
        data = check_dataset(datasets.write_manifest(tmp_path, rows))
        (doubt,) = data.findings
        assert str(doubt).startswith("actors Ann, Ben: have the same bones")
        assert data.notes[0].startswith("Actors Ann, Ben have the same bones")
