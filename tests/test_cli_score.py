"""`fervor score`: files here or by a service, as table, CSV and JSON; a broken one among good ones."""

import csv
import io
import json
from pathlib import Path

import pytest

from bodies import model
from fervor.cli.main import run
from fervor.protocol.messages import Estimate
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.recordings.reader import read_recording
from fervor.server.scoring_models import ScoreResponse
from live import Live
from program import fervor, write_bvh


@pytest.fixture
def good(tmp_path: Path) -> Path:
    return write_bvh(tmp_path / "good.bvh")


@pytest.fixture
def bad(tmp_path: Path, good: Path) -> Path:
    path = tmp_path / "bad.bvh"
    path.write_text(good.read_text(encoding="utf-8")[:1200], encoding="utf-8")
    return path


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "250")


def test_a_table_for_people(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(good), "--emotion", "happy"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "good.bvh" in shown.out
    assert "joy" in shown.out
    assert "121" in shown.out
    assert model().metadata.name in shown.out
    assert ("not science" in shown.out) == (model().metadata.purpose == "demo")


def test_without_an_emotion_it_says_what_that_means(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(good)]) == 0
    assert "emotion unknown" in capsys.readouterr().out


def test_a_broken_file_costs_no_other_its_score(good: Path, bad: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(bad), str(good), str(good.with_name("none.bvh")), "--csv"]) == 65
    told = capsys.readouterr()
    assert [row["file"] for row in csv.DictReader(io.StringIO(told.out))] == [str(good)]
    first, second = told.err.splitlines()
    assert first.startswith(f"fervor: {bad}, line ")
    assert second == f"fervor: {good.with_name('none.bvh')}: can't be read: No such file or directory"


def test_only_broken_files(bad: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(bad), "--json"]) == 65
    assert capsys.readouterr().out == ""


def test_an_unknown_emotion_is_told_once(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(good), str(good), "--emotion", "jooy"]) == 65
    assert capsys.readouterr().err.count("emotion 'jooy' is not known") == 1


def test_csv_of_summaries_and_of_frames(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(good), "--emotion", "joy", "--csv"]) == 0
    (summary,) = csv.DictReader(io.StringIO(capsys.readouterr().out))
    assert run(["score", str(good), "--emotion", "joy", "--csv", "--frames"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert int(summary["frames"]) == len(rows) == 121
    assert float(summary["last"]) == float(rows[-1]["intensity"])
    settled = [float(row["intensity"]) for row in rows if row["status"] == "ok"]
    assert float(summary["peak"]) == max(settled)
    assert rows[1]["flags"] == "between_steps"


def test_json_is_what_the_service_says(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["score", str(good), "--json", "--frames", "--emotion", "joy"]) == 0
    report = ScoreResponse.model_validate_json(capsys.readouterr().out)
    assert report.model.sha256 == model().sha256
    (scored,) = report.sequences
    assert isinstance(scored.estimates[0], Estimate)
    assert len(scored.estimates) == scored.frames


def test_a_file_to_write_to(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "scores.json"
    assert run(["score", str(good), "--out", str(out)]) == 0
    assert json.loads(out.read_text(encoding="utf-8"))["sequences"][0]["name"] == str(good)
    assert "good.bvh" in capsys.readouterr().out  # a table for whoever looks on


@pytest.mark.parametrize(
    ("options", "code", "sentence"),
    [
        (["--json", "--csv"], 2, "only one of --json and --csv"),
        (["--frames"], 2, "a table has no place for every frame"),
        (["--out", "scores.xls"], 2, "says no format"),
        (["--html", "scores.png"], 2, "must end in .html"),
        (["--html", "/no/such/folder/scores.html"], 73, "can't be written: its folder is not there"),
        (["--out", "/no/such/folder/scores.csv"], 73, "can't be written: No such file or directory"),
        (["--model", "none.onnx"], 65, "none.onnx can't be read as a model file"),
        (["--url", "http://x", "--model", "a.onnx"], 2, "has a model of its own"),
        (["--url", "ftp://x"], 65, "'ftp://x' is not the address of a service"),
        (["--url", "http://127.0.0.1:1"], 69, "no service answers at http://127.0.0.1:1/v1/score/file"),
        (["--clock", "sundial"], 2, "sundial"),
    ],
)
def test_what_can_be_wrong_with_options(
    options: list[str], code: int, sentence: str, good: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["score", str(good), *options]) == code
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_clock_and_memory_matter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    long, scores = write_bvh(tmp_path / "long.bvh", seconds=10.0), []
    for options in ([], ["--clock", "frames"], ["--memory", "window"]):
        assert run(["score", str(long), "--json", *options]) == 0
        scores.append(json.loads(capsys.readouterr().out)["sequences"][0]["intensity"]["mean"])
    assert len(set(scores)) == len(scores)


def test_a_page_of_pictures_for_what_can_be_read(
    good: Path, bad: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "scores.html"
    assert run(["score", str(good), str(bad), str(good), "--emotion", "joy", "--html", str(out)]) == 65
    page = out.read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "bad.bvh" not in page
    assert "good.bvh" in capsys.readouterr().out  # the table stays


def test_a_page_changes_no_other_output(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for how in (["--json"], ["--csv"], ["--json", "--frames"]):
        assert run(["score", str(good), *how]) == 0
        plain = capsys.readouterr().out
        assert run(["score", str(good), *how, "--html", str(tmp_path / "scores.html")]) == 0
        assert capsys.readouterr().out == plain


# --- by a service -----------------------------------------------------------------------------------------------------


def test_a_service_gives_the_same_score(live: Live, good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["score", str(good), "--emotion", "joy", "--json", "--frames"]
    assert run(given) == 0
    here = json.loads(capsys.readouterr().out)
    assert run([*given, "--url", live.url]) == 0
    assert json.loads(capsys.readouterr().out) == here


def test_a_service_gives_the_same_page(live: Live, good: Path, tmp_path: Path) -> None:
    here, there = tmp_path / "here.html", tmp_path / "there.html"
    assert run(["score", str(good), "--emotion", "joy", "--html", str(here)]) == 0
    assert run(["score", str(good), "--emotion", "joy", "--html", str(there), "--url", live.url]) == 0
    assert here.read_bytes() == there.read_bytes()


def test_a_service_tells_of_a_broken_file(
    live: Live, good: Path, bad: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["score", str(bad), str(good), "--csv", "--url", live.url]) == 65
    told = capsys.readouterr()
    assert "bad.bvh, line " in told.err
    assert "good.bvh" in told.out


def test_a_service_wants_its_token(start_service, good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    service = start_service(tokens="alpha")
    assert run(["score", str(good), "--url", service.url]) == 77
    assert "needs a token" in capsys.readouterr().err
    assert run(["score", str(good), "--url", service.url, "--token", "alpha"]) == 0


def test_real_files(shared_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted(map(str, shared_data.glob("*/*.bvh")))
    assert run(["score", *files, "--emotion", "joy", "--csv"]) == 0
    assert [row["file"] for row in csv.DictReader(io.StringIO(capsys.readouterr().out))] == files


def test_a_calibrated_skeleton_serves_here_but_is_not_sent(tmp_path: Path) -> None:
    recording = write_bvh(tmp_path / "wave.bvh")
    spec = SkeletonSpec.of(read_recording(recording).skeleton, name="lab")
    (tmp_path / "lab.json").write_text(spec.model_dump_json(), encoding="utf-8")
    plain, kept = (
        json.loads(fervor("score", recording, "--json", *more).stdout)["sequences"][0]["intensity"]
        for more in ((), ("--skeleton", tmp_path / "lab.json"))
    )
    assert plain == kept
    ran = fervor("score", recording, "--skeleton", tmp_path / "lab.json", "--url", "http://127.0.0.1:1")
    assert ran.returncode == 65
    assert "a service takes no file" in ran.stderr
