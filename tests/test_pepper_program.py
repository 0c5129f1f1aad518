"""The `fervor-pepper` program as a person runs it: a dry run, a real robot, frames piped in, and what it refuses."""

import json
import os
import re
import signal
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import pytest

from live import Live
from robots import QiRobot, need_qi
from test_docs import short_sample

PROGRAM = str(Path(sys.executable).with_name("fervor-pepper"))
SAMPLE = Path(__file__).resolve().parents[1] / "service" / "fervor" / "samples" / "joy.bvh"
EAGER = """
timing: {settle_s: 0, rest_s: 0, emotion_rest_s: 0}
language: en
languages: {en: {voice: English, fillers: [oh, hmm], lines: {joy: {weak: ["you look so happy!"]}}}}
reactions: {joy: {weak: {say: true}, strong: {gestures: [animations/none, animations/Stand/Gestures/Hey_1]}}}
"""


def run(*arguments: object, stdin: str = "", **environment: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        input=stdin,
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """Two seconds of the sample."""
    path = tmp_path / "short.bvh"
    path.write_text(short_sample(), encoding="utf-8")
    return path


def test_a_dry_run_prints_what_a_robot_would_do(live: Live, short: Path, tmp_path: Path) -> None:
    log = tmp_path / "s.csv"
    ran = run(
        "--dry-run", "--service", live.stream, "--play", short, "--emotion", "joy", "--language", "de", "--seed", 1,
        "--log", log, "--participant", "P07",
    )  # fmt: skip
    assert (ran.returncode, ran.stderr) == (0, "")
    assert re.fullmatch(r' +\d+\.\d s  weak joy, body 0: says ".+" \[de\]\n', ran.stdout)
    assert "P07,expressive,done,0,,,joy,weak" in log.read_text(encoding="utf-8")


def test_frames_may_be_piped_in_and_a_bad_one_harms_itself_alone(live: Live, tmp_path: Path) -> None:
    behaviour = tmp_path / "eager.yaml"
    behaviour.write_text(EAGER)
    pose = [[0.0, 0.0, 0.0, 1.0]] * 13
    lines = [{"t": number / 30, "q": pose, "emotion": "joy", "body": "ann"} for number in range(60)]
    text = "\n".join(map(json.dumps, lines[:30])) + '\nnonsense\n{"t": 1}\n{"t": 1, "x": 2}\n'
    text += "\n".join(map(json.dumps, [*lines[30:], {"body": "ann", "gone": True}])) + "\n"
    ran = run("--dry-run", "--service", live.stream, "--behaviour", behaviour, stdin=text)
    assert ran.returncode == 0
    assert 'weak joy, body ann: says "you look so happy!" [en]' in ran.stdout
    assert [line.removeprefix("fervor: ") for line in ran.stderr.splitlines()[:3]] == [
        "line 31: the message is not JSON: expected ident at line 1 column 2",
        "line 32: a frame needs q or p, one entry a joint",
        "line 33: x is not a field of a frame line",
    ]


@pytest.mark.slow
def test_the_whole_chain_at_the_pace_of_life(live: Live) -> None:
    """A service, the sample, and a robot: speech while joy is weak, then gestures while it is strong, then speech."""
    need_qi()
    with QiRobot(seconds=0.5) as robot:
        ran = run("--robot", robot.url, "--service", live.stream, "--play", SAMPLE, "--emotion", "joy")
        assert (ran.returncode, ran.stderr) == (0, "")
        done = [call[1] for call in robot.calls() if call[1] in ("say", "run")]
    assert [what for what, _ in groupby(done)] == ["say", "run", "say"]


def test_a_robot_is_told(live: Live, short: Path) -> None:
    need_qi()
    with QiRobot(animations=("x",)) as robot:
        ran = run("--robot", robot.url, "--service", live.stream, "--play", short, "--emotion", "joy")
        assert ran.returncode == 0, ran.stderr
        assert ["ALTextToSpeech", "setLanguage", "English"] in list(robot.calls_until("raiseEvent"))


def test_ctrl_c_ends_it_quietly(live: Live, short: Path) -> None:
    process = subprocess.Popen(
        [PROGRAM, "--dry-run", "--loop", "--service", live.stream, "--play", str(short), "--emotion", "joy"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert "weak joy" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "")


def test_the_packaged_behaviour_can_be_printed_and_read_again(tmp_path: Path) -> None:
    printed = run("--print-behaviour").stdout
    (tmp_path / "my.yaml").write_text(printed.replace("rest_s: 2", "rest_s: -2"), encoding="utf-8")
    ran = run("--dry-run", "--behaviour", tmp_path / "my.yaml")
    assert ran.returncode == 65
    assert re.fullmatch(
        r"fervor-pepper: .*my.yaml, line \d+: timing.rest_s: input should be greater than or equal to 0, but -2 came\n",
        ran.stderr,
    )


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--play", "none.bvh", "--dry-run"], 65, "none.bvh"),
        (["--robot", "pepper.local", "--play", "{sample}"], 65, "expected one like tcp://pepper.local:9559"),
        (["--play", "{sample}"], 65, "no robot is named; expected --robot tcp://HOST:9559, or --dry-run"),
        (["--dry-run", "--play", "{sample}", "--service", "ws://127.0.0.1:1"], 69, "is `fervor serve` running there?"),
        (["--dry-run", "--play", "{sample}", "--language", "xx"], 65, "language 'xx' is not in the behaviour"),
        (["--dry-run", "--play", "{sample}", "--log", "s.csv", "--participant", "Ann Smith"], 65, "is not a code"),
        (["--dry-run", "--play", "{sample}", "--emotion", "glee"], 65, "glee"),
    ],
)
def test_what_is_refused_is_told_in_one_sentence(
    live: Live, short: Path, arguments: list[str], code: int, said: str
) -> None:
    if "--robot" in arguments:
        need_qi()
    filled = [argument.format(sample=short) for argument in arguments]
    service = [] if "--service" in filled else ["--service", live.stream]
    ran = run(*filled, *service)
    assert (ran.returncode, ran.stdout) == (code, "")
    assert said in ran.stderr
    assert ran.stderr.startswith("fervor-pepper: ")
    assert ran.stderr.count("\n") == 1


@pytest.mark.parametrize("module", ["qi", "yaml"])
def test_what_is_not_installed_is_named_with_its_remedy(module: str, short: Path) -> None:
    need_qi()
    program = f"import sys; sys.modules[{module!r}] = None; from fervor_pepper.main import main; main()"
    arguments = ["--robot", "tcp://127.0.0.1:9559", "--play", str(short)]
    ran = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=110, check=False
    )
    assert ran.returncode == 69
    assert ran.stderr == f'fervor-pepper: this needs {module}, which is not installed: pip install "fervor[pepper]"\n'
