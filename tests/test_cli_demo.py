import re
import signal
import socket
from pathlib import Path

import pytest

from fervor.cli.demo import pick_port
from fervor.cli.local import HOST, free_port, is_free
from program import fervor, start_fervor, write_bvh


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return write_bvh(tmp_path / "wave.bvh", seconds=1.0)


def test_intensities_move_within_seconds(wave: Path) -> None:
    port = free_port()
    done = fervor("demo", wave, "--seconds", "2.5", "--port", port)
    assert done.returncode == 0
    head, *lines = done.stdout.splitlines()
    assert head.startswith("wave: demo model")
    intensities = [float(line.split()[3]) for line in lines]
    assert len(set(intensities)) >= 3
    assert all(0.0 <= intensity <= 1.0 for intensity in intensities)
    assert "\x1b" not in done.stdout
    assert f"the service runs at http://{HOST}:{port}" in done.stderr
    assert "Ctrl-C stops" in done.stderr
    assert is_free(port), "the service ends with the demo"


def test_a_taken_port_is_no_obstacle(wave: Path) -> None:
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
        done = fervor("demo", wave, "--seconds", "0.2", "--port", port)
    assert done.returncode == 0
    told = re.search(rf"port {port} is taken; using (\d+) instead", done.stderr)
    assert told is not None
    assert f"http://{HOST}:{told[1]}" in done.stderr


def test_a_free_port_is_taken_as_wanted(capsys: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    assert pick_port(port) == port
    assert capsys.readouterr().err == ""


def test_ctrl_c_stops_both(wave: Path) -> None:
    port = free_port()
    with start_fervor("demo", wave, "--port", port) as program:
        assert program.stdout is not None
        program.stdout.readline()
        assert program.stdout.readline().strip().startswith("0.00 s")
        program.send_signal(signal.SIGINT)
        program.communicate(timeout=20)
    assert program.returncode == 130
    assert is_free(port)


def test_the_sample_comes_with_fervor() -> None:
    done = fervor("demo", "--seconds", "1", "--port", free_port())
    assert done.returncode == 0
    assert done.stdout.startswith("joy: ")
    assert len(done.stdout.splitlines()) >= 2
