"""`fervor study` as a person runs it: from an empty form to the report."""

import json
import re
import xml.etree.ElementTree as ET
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from fervor.cli.main import run
from fervor_pepper.acts import Act, Voice
from fervor_pepper.session_log import SessionLog
from fervor_pepper.stage import Outcome
from fervor_pepper.study.answers import Question, add_answers
from fervor_pepper.study.sessions import read_sessions
from shows import estimate


class Ran(NamedTuple):
    """How the program ended."""

    returncode: int
    stdout: str
    stderr: str


Fervor = Callable[..., Ran]


@pytest.fixture
def fervor(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Fervor:
    """Runs the program in this process: a process of its own would load statsmodels each time."""
    monkeypatch.setenv("COLUMNS", "120")

    def run_it(*arguments: object) -> Ran:
        code = run([*map(str, arguments)])
        return Ran(code, *capsys.readouterr())

    return run_it


CONDITIONS = ("none", "label", "full")


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Fourteen people in three conditions on two scales; one has no answer on one of them."""
    folder = tmp_path / "study"
    dice = np.random.default_rng(7)
    rows = ["participant,condition,scale,item,answer"]
    for person in range(1, 15):
        for place, condition in enumerate(CONDITIONS):
            for scale, gain in (("smart", 1.0), ("a <b> & c", 0.0)):
                answer = int(np.clip(round(3 + gain * place + dice.normal(0, 0.9)), 1, 7))
                missing = (person, condition, scale) == (7, "label", "smart")
                rows.append(f"P{person:02d},{condition},{scale},1,{'' if missing else answer}")
    folder.mkdir()
    (folder / "answers.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return folder


def test_from_an_empty_form_to_answers(fervor: Fervor, tmp_path: Path) -> None:
    folder = tmp_path / "s"
    made = fervor(
        "study", "template", folder, "--participants", 3, "--condition", "none", "--condition", "full",
        "--scale", "warm:2",
    )  # fmt: skip
    assert (made.returncode, made.stdout) == (0, f"{folder / 'answers.csv'}\n")
    for condition, answer in (("none", 2), ("full", 5)):
        added = fervor(
            "study", "add", folder, f"warm={answer}", f"warm:2={answer}", "--participant", "P01",
            "--condition", condition,
        )  # fmt: skip
        assert (added.returncode, added.stdout) == (0, f"{folder / 'answers.csv'}: 2 added\n")
    others = (("P02", "none", 3), ("P02", "full", 4), ("P03", "none", 3), ("P03", "full", 6))
    add_answers(folder, [(Question(person, condition, "warm"), answer) for person, condition, answer in others])
    shown = fervor("study", folder)
    assert shown.returncode == 0
    assert "F(1, 2) = " in shown.stdout


def test_the_table_says_what_a_paper_would(fervor: Fervor, study: Path) -> None:
    shown = fervor("study", study)
    assert shown.returncode == 0, shown.stderr
    assert re.search(r"smart  F\([\d.]+, [\d.]+\) = [\d.]+, p [<=] 0\.\d+, partial η² = 0\.\d+", shown.stdout)
    assert "n = 13" in shown.stdout
    assert "n = 14" in shown.stdout
    assert "P07 has no answer on smart in label, and is left out of it" in shown.stdout
    assert "label - none" in shown.stdout


def test_json_and_table_and_html_say_the_same(fervor: Fervor, study: Path, tmp_path: Path) -> None:
    html = tmp_path / "report.html"
    said = fervor("study", study, "--json", "--html", html)
    result = json.loads(said.stdout)
    smart = next(scale for scale in result["scales"] if scale["scale"] == "smart")
    page = html.read_text(encoding="utf-8")
    assert f"= {smart['anova']['f']:.2f}, " in page
    assert all(f">{pair['t']:.2f}<" in page for pair in smart["pairs"])
    assert len(smart["scores"]) == len(smart["participants"]) == 13
    assert "a &lt;b&gt; &amp; c" in page
    assert "<b>" not in page


def test_the_plots_show_every_participant(fervor: Fervor, study: Path, tmp_path: Path) -> None:
    html = tmp_path / "report.html"
    fervor("study", study, "--html", html)
    images = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", html.read_text(encoding="utf-8"))
    assert len(images) == 2
    trees = [ET.fromstring(b64decode(image)) for image in images]
    for tree, people in zip(trees, (13, 14), strict=True):
        lines = [node for node in tree.iter() if re.fullmatch(r"line2d_\d+", node.get("id", ""))]
        grey = [node for node in lines if any("#8a8a8a" in (part.get("style") or "") for part in node.iter())]
        assert len(grey) == people


def log(path: Path, condition: str, acts: int) -> None:
    clock = iter(np.arange(0.0, 1000.0, 3.0))
    written = SessionLog(path, participant="P01", condition=condition, clock=lambda: float(next(clock)))
    written.begin("")
    for number in range(acts):
        act = Act(number, Voice("en", "English"), say="oh")
        written.act(act)
        written.outcome(Outcome(act))
    written.estimate(estimate(level="strong"))
    written.estimate(estimate(level="weak"))
    written.end()


def test_what_the_robot_did_is_counted_from_the_logs(fervor: Fervor, study: Path) -> None:
    log(study / "a.csv", "none", 2)
    log(study / "b.csv", "full", 3)
    log(study / "b.csv", "full", 0)
    with (study / "b.csv").open("a") as file:
        file.write("2026-01-01T00:00:00.0")  # a crash
    doings = {one.condition: one for one in read_sessions(study)}
    assert set(doings) == {"none", "full"}
    full = doings["full"]
    assert (full.sessions, len(full.participants), full.spoken, full.gestures) == (2, 1, 3, 0)
    assert (full.estimates, full.strong, full.seconds) == (4, 2, 42.0)
    assert "What the robot did" in fervor("study", study).stdout
    assert json.loads(fervor("study", study, "--json").stdout)["sessions"][1]["spoken"] == 2


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["{tmp}/none"], 65, "answers.csv is missing"),
        (["add", "{tmp}", "warm", "--participant", "P01", "--condition", "none"], 65, "'warm' is no answer"),
        (["add", "{tmp}", "warm=8", "--participant", "P01", "--condition", "none"], 65, "from 1 to 7"),
        (["add", "{tmp}", "warm=4", "--participant", "Ann S", "--condition", "none"], 65, "is not a code"),
        (
            ["template", "{tmp}/x", "--participants", "2", "--condition", "a", "--condition", "b", "--scale", "w:0"],
            65,
            "'w:0' is no scale",
        ),
    ],
)
def test_what_is_refused_is_told_in_one_sentence(
    fervor: Fervor, tmp_path: Path, arguments: list[str], code: int, said: str
) -> None:
    ran = fervor("study", *[argument.format(tmp=tmp_path) for argument in arguments])
    assert ran.returncode == code
    assert said in ran.stderr
    assert ran.stderr.count("\n") == 1


def test_a_study_of_which_nothing_can_be_said_ends_with_an_error(fervor: Fervor, tmp_path: Path) -> None:
    (tmp_path / "answers.csv").write_text("participant,condition,scale,item,answer\nP01,a,warm,1,4\n")
    ran = fervor("study", tmp_path)
    assert ran.returncode == 65
    assert "warm is not compared: there is one condition" in ran.stdout


def test_the_help_names_all_commands(fervor: Fervor) -> None:
    shown = fervor("study", "--help").stdout
    assert all(command in shown for command in ("analyse", "add", "template"))
