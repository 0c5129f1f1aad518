"""`fervor data check` and what it says: numbers, plots in one page, JSON, exit codes."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from datasets import EBMDB_TABLE, takes, write_ebmdb, write_manifest, write_table
from fervor.cli.main import run
from fervor_export.data.dataset import check_dataset, load_dataset
from fervor_export.data.plots import plots
from fervor_export.data.report import html_report
from fervor_export.data.summary import noise_ceiling, summarise


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("COLUMNS", "120")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_ebmdb(tmp_path / "data", takes(12))
    return tmp_path / "data"


def test_numbers(folder: Path) -> None:
    made = takes(12)
    summary = summarise(check_dataset(folder))
    assert (summary.clips, summary.recordings, summary.t_poses) == (12, 12, 12)
    assert {group.name: group.clips for group in summary.actors} == {"AnBh": 6, "DiMi": 6}
    assert "neutral" not in {group.name for group in summary.emotions}
    assert summary.neutral is not None
    assert summary.neutral.mean == next(take.votes for take in made if take.emotion == "neutral") / 11
    assert summary.emotions[0].mean == pytest.approx(np.mean([made[0].votes, made[11].votes]) / 11)
    assert (summary.observers, summary.rates) == ({"11": 12}, {"120": 12})
    assert summary.seconds == (1.5, 1.5, 1.5)


def test_the_ceiling_is_that_of_a_perfect_estimate() -> None:
    """The true share itself correlates with drawn labels as much as the ceiling says."""
    clips = load_dataset("synthetic", clips=400, votes=True).clips
    truth = load_dataset("synthetic", clips=400).clips
    keep = [place for place, clip in enumerate(truth) if clip.emotion != "neutral"]
    r = np.corrcoef([clips[place].intensity for place in keep], [truth[place].intensity for place in keep])[0, 1]
    assert noise_ceiling([clips[place] for place in keep]) == pytest.approx(r, abs=0.03)
    assert noise_ceiling(truth) is None


def test_one_page_with_plots_and_nothing_beside_it(tmp_path: Path) -> None:
    name = "<script>alert(1)"
    made = takes(3)
    rows = write_ebmdb(tmp_path, made)
    rows.append(rows[0] | {"motion_id": name})
    write_table(tmp_path / EBMDB_TABLE, rows)
    data = check_dataset(tmp_path)
    page = html_report(data, summarise(data))
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert page.count("<img ") == len(plots(data)) == 6
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert page == html_report(data, summarise(data))


def test_check_shows_tables_and_is_content(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["data", "check", str(folder)]) == 0
    out = capsys.readouterr().out
    for word in ("AnBh", "DiMi", "amusement", "neutral", "noise ceiling", "12 of 12 recordings"):
        assert word in out
    assert "can't be used" not in out


def test_check_lists_all_faults_and_exits_with_65(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted((folder / "bvh").iterdir())
    files[0].unlink()
    files[1].write_text("broken")
    (folder / "bvh" / "LeSt_0101_x_t1_joy_00000-00180.bvh").touch()
    assert run(["data", "check", str(folder), "--html", str(folder / "out.html")]) == 65
    out = capsys.readouterr().out
    assert "can't be used (3)" in out
    for file in (files[0], files[1]):
        assert file.stem in out
    assert "LeSt_0101" in (folder / "out.html").read_text()


def test_check_as_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "bvh" / "extra.bvh").touch()
    assert run(["data", "check", str(folder), "--json"]) == 65
    told = json.loads(capsys.readouterr().out)
    assert told["clips"] == 12
    assert told["findings"] == [
        {"severity": "unusable", "where": "extra.bvh", "what": f"no row of {EBMDB_TABLE} names this file"}
    ]


def test_check_of_what_is_no_data_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["data", "check", str(tmp_path / "absent")]) == 65
    assert "neither a folder nor a manifest" in capsys.readouterr().err
    manifest = write_manifest(tmp_path, [{"file": "lost.bvh", "emotion": "joy", "votes": "1/2", "actor": "Ann"}])
    assert run(["data", "check", str(manifest)]) == 65
    assert "there is no file" in capsys.readouterr().out


def test_a_report_that_cannot_be_written_is_an_error(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["data", "check", str(folder), "--html", str(folder / "no" / "out.html")]) == 65
    assert "can't be written" in capsys.readouterr().err
