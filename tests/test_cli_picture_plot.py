"""`fervor stream --plot`: a picture at the end, at Ctrl-C, and when the service is lost; and what can be wrong."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fervor.cli.picture.plot import MOST_S, Plot
from fervor.cli.picture.rule import hysteresis_at
from live import Live
from pictures import MODEL, estimate
from program import fervor, start_fervor, write_bvh

PNG, SVG = b"\x89PNG", b"<?xml"


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    return write_bvh(tmp_path / "wave.bvh", seconds=1.5)


def test_a_picture_at_the_end_changes_no_estimate(live: Live, wave: Path):
    given = ("stream", wave, "--url", live.stream, "--emotion", "joy", "--fast", "--json")
    plain, drawn = fervor(*given), fervor(*given, "--plot", wave.with_suffix(".svg"))
    assert drawn.stdout == plain.stdout
    assert drawn.stderr == f"fervor: {wave.with_suffix('.svg')} shows what was streamed\n"
    assert wave.with_suffix(".svg").read_bytes().startswith(SVG)


def test_ctrl_c_draws_what_came_so_far(live: Live, wave: Path):
    out = wave.with_suffix(".png")
    with start_fervor("stream", wave, "--url", live.stream, "--loop", "--json", "--plot", str(out)) as program:
        assert program.stdout is not None
        while json.loads(program.stdout.readline())["seq"] < 120:  # into its second round
            pass
        program.send_signal(signal.SIGINT)
        _, said = program.communicate(timeout=60)
    assert (program.returncode, said) == (130, f"fervor: {out} shows what was streamed\n")
    assert out.read_bytes().startswith(PNG)


def test_a_service_that_goes_away_leaves_a_picture(start_service, wave: Path):
    service, out = start_service(shutdown_grace_s=0), wave.with_suffix(".png")
    with start_fervor("stream", wave, "--url", service.stream, "--loop", "--json", "--plot", str(out)) as program:
        assert program.stdout is not None
        program.stdout.readline()
        service.stop()
        program.communicate(timeout=60)
    assert program.returncode == 69
    assert out.read_bytes().startswith(PNG)


def test_where_nobody_answers_nothing_is_drawn(wave: Path):
    done = fervor("stream", wave, "--url", "ws://127.0.0.1:1", "--plot", wave.with_suffix(".png"))
    assert done.returncode == 69
    assert len(done.stderr.splitlines()) == 1
    assert not wave.with_suffix(".png").exists()


@pytest.mark.parametrize(
    ("name", "exit_code", "sentence"),
    [("wave.gif", 2, "must end in .png or .svg"), ("none/wave.png", 73, "its folder is not there")],
)
def test_a_target_is_looked_at_before_anything_is_streamed(wave: Path, name: str, exit_code: int, sentence: str):
    done = fervor("stream", wave, "--url", "ws://127.0.0.1:1", "--plot", wave.parent / name)
    assert done.returncode == exit_code
    assert sentence in " ".join(done.stderr.replace("│", " ").split())


def test_without_matplotlib_it_says_what_to_install(wave: Path):
    blind = "import sys; sys.modules['matplotlib'] = None; from fervor.cli.main import main; main()"
    for command, option in (("stream", "--plot=a.png"), ("score", "--html=a.html")):
        done = subprocess.run(
            [sys.executable, "-c", blind, command, str(wave), option], capture_output=True, text=True, check=False
        )
        assert done.returncode == 69
        name = option.partition("=")[0]
        assert done.stderr == f'fervor: {name} needs matplotlib, which is not installed: pip install "fervor[plot]"\n'


def test_commands_that_draw_nothing_import_nothing_to_draw_with(wave: Path):
    watched = (
        "import sys; from fervor.cli.main import run; code = run(sys.argv[1:]); "
        "sys.exit(code or any(name.startswith('matplotlib') for name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", watched, "score", str(wave)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_a_plot_forgets_what_is_old(tmp_path: Path):
    class Nowhere:
        def show(self, estimate) -> None: ...

    plot = Plot(tmp_path / "a.png", "a")
    screen = plot.beside(Nowhere(), MODEL)
    pose = np.zeros((13, 4))
    for time, _ in plot.watch((float(time), pose) for time in range(5000)):
        screen.show(estimate(int(time), t=time))
    assert [one.t for one in plot._estimates] == [time for time, _ in plot._frames]
    assert plot._frames[-1][0] - plot._frames[0][0] == MOST_S


def test_the_band_is_that_of_the_service(live: Live):
    assert hysteresis_at(live.url, None) == 0.05
    assert hysteresis_at("http://127.0.0.1:1", None) is None
    assert hysteresis_at(f"{live.url}/elsewhere", None) is None
