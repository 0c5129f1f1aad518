import json
import os
import pty
import re
import select
import signal
import socket
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import fervor_client
from fervor.protocol.messages import Estimate
from live import Live
from program import FERVOR, fervor, start_fervor, write_bvh


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return write_bvh(tmp_path / "wave.bvh", seconds=1.5)


def test_json_is_one_estimate_a_line_and_nothing_else(live: Live, wave: Path) -> None:
    done = fervor("stream", wave, "--url", live.stream, "--emotion", "joy", "--fast", "--json", "--body", "ann")
    assert (done.returncode, done.stderr) == (0, "")
    estimates = [Estimate(**json.loads(line)) for line in done.stdout.splitlines()]
    assert [(estimate.body, estimate.seq) for estimate in estimates] == [("ann", seq) for seq in range(91)]
    assert {estimate.emotion for estimate in estimates} == {"joy"}
    assert len({estimate.intensity for estimate in estimates}) > 20


def test_its_own_pace_and_fast_give_the_same_estimates(live: Live, wave: Path) -> None:
    slow, fast = (fervor("stream", wave, "--url", live.stream, "--json", *how) for how in ((), ("--fast",)))
    assert slow.stdout == fast.stdout != ""


def test_memory_and_clock_reach_the_service(live: Live, wave: Path) -> None:
    plain, other = (
        fervor("stream", wave, "--url", live.stream, "--json", "--fast", *more).stdout
        for more in ((), ("--clock", "frames", "--memory", "stateful"))
    )
    assert len(plain.splitlines()) == len(other.splitlines())
    assert "between_steps" in plain
    assert "between_steps" not in other


def test_a_pipe_gets_plain_lines(live: Live, wave: Path) -> None:
    done = fervor(
        "stream", wave, "--url", live.stream, "--emotion", "joy", "--fast", env={**os.environ, "FORCE_COLOR": "1"}
    )
    head, *lines = done.stdout.splitlines()
    assert head.startswith("wave: demo model")
    assert len(lines) >= 3
    assert "\x1b" not in done.stdout
    assert done.stdout.isascii()


def test_it_works_by_itself_where_no_service_runs(wave: Path) -> None:
    done = fervor("stream", wave, "--fast", "--json")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 91
    with socket.socket() as probe:
        alone = probe.connect_ex(("127.0.0.1", 8080)) != 0
    if alone:
        assert done.stderr == "fervor: no service runs on this machine; starting one for this recording\n"


@pytest.mark.parametrize(
    ("more", "exit_code", "sentence"),
    [
        (("--url", "ws://127.0.0.1:1"), 69, "no service answers at ws://127.0.0.1:1/v1/stream: connection refused"),
        (("--url", "http://127.0.0.1:1"), 65, "is not the address of a stream"),
    ],
)
def test_a_wrong_address_is_one_sentence(wave: Path, more: tuple[str, ...], exit_code: int, sentence: str) -> None:
    done = fervor("stream", wave, *more)
    assert (done.returncode, done.stdout) == (exit_code, "")
    assert sentence in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_an_unknown_emotion_is_one_sentence(live: Live, wave: Path) -> None:
    done = fervor("stream", wave, "--url", live.stream, "--emotion", "ennui")
    assert done.returncode == 65
    assert "'ennui' is not known" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_other_kinds_of_recordings_are_streamed_too(live: Live, tmp_path: Path) -> None:
    joints = np.tile([0.0, 0.0, 0.0, 1.0], (30, 13, 1)).tolist()
    lines = [json.dumps({"t": number / 30, "q": pose}) for number, pose in enumerate(joints)]
    table = tmp_path / "still.jsonl"
    table.write_text("\n".join(lines) + "\n")
    done = fervor("stream", table, "--skeleton", "c13", "--url", live.stream, "--fast", "--json")
    assert (done.returncode, done.stderr, len(done.stdout.splitlines())) == (0, "", 30)


def test_a_file_that_is_no_recording_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "note.bvh").write_text("hello")
    for name in ("note.bvh", "absent.bvh"):
        done = fervor("stream", tmp_path / name)
        assert done.returncode == 65
        assert name in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_ctrl_c_ends_the_session_and_the_program(live: Live, wave: Path) -> None:
    open_before = live.service.sessions.open
    with start_fervor("stream", wave, "--url", live.stream, "--loop", "--json") as program:
        assert program.stdout is not None
        assert json.loads(program.stdout.readline())["seq"] == 0
        assert live.service.sessions.open == open_before + 1
        program.send_signal(signal.SIGINT)
        _, said = program.communicate(timeout=20)
    assert (program.returncode, said) == (130, "")
    with fervor_client.sync.connect(live.stream):  # by now the service has seen the end
        assert live.service.sessions.open == open_before + 1


def test_a_reader_that_goes_away_ends_the_program(live: Live, wave: Path) -> None:
    with start_fervor("stream", wave, "--url", live.stream, "--loop", "--json") as program:
        assert program.stdout is not None
        assert program.stderr is not None
        program.stdout.readline()
        program.stdout.close()
        assert program.wait(20) == 141
        assert program.stderr.read() == ""


def test_a_service_that_goes_away_is_one_sentence(start_service, wave: Path) -> None:
    service = start_service(shutdown_grace_s=0)
    with start_fervor("stream", wave, "--url", service.stream, "--loop", "--json") as program:
        assert program.stdout is not None
        program.stdout.readline()
        service.stop()
        _, said = program.communicate(timeout=60)
    assert program.returncode == 69
    assert re.fullmatch(r"fervor: .* tried to reconnect \d+ times.*", said.splitlines()[-1])


def test_a_terminal_gets_a_meter_that_moves(live: Live, wave: Path) -> None:
    ours, theirs = pty.openpty()
    command = [FERVOR, "stream", str(wave), "--url", live.stream, "--emotion", "joy"]
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "80", "LINES": "24"}
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment) as program:
        os.close(theirs)
        shown = read_terminal(ours)
    os.close(ours)
    assert program.returncode == 0
    assert "waiting" in shown
    pictures = re.findall(r"joy +\S*?(\d\.\d\d)", re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", shown))
    assert len(pictures) >= 5
    assert len(set(pictures)) >= 2
    assert "demo model" in shown
    assert "\x1b[?25h" in shown, "the cursor is back"


def read_terminal(descriptor: int, timeout: float = 30.0) -> str:
    """Everything a program wrote to its terminal, up to its end."""
    until, shown = time.monotonic() + timeout, b""
    while select.select([descriptor], [], [], max(until - time.monotonic(), 0.0))[0]:
        try:
            piece = os.read(descriptor, 65536)
        except OSError:  # how Linux tells the other side's end
            break
        if not piece:
            break
        shown += piece
    return shown.decode()
