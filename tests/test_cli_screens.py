import io
import json
from contextlib import redirect_stdout

import pytest

from fervor.cli.screens import Complaints, JsonScreen, LineScreen, LiveScreen, pick_screen
from fervor.errors import FrameError
from fervor.protocol.messages import Estimate
from test_cli_meter import DEMO, estimate


class Terminal(io.StringIO):
    """Standard output as a terminal has it."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """A terminal; standard output is to be redirected to it."""
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "80")
    return Terminal()


def test_a_terminal_gets_a_meter_that_moves(terminal: Terminal) -> None:
    with redirect_stdout(terminal), pick_screen("wave", DEMO, duration_s=2.0, json=False) as screen:
        assert isinstance(screen, LiveScreen)
        assert "waiting" in terminal.getvalue()
        screen.show(estimate(0.0, 0.11))
        screen.show(estimate(0.01, 0.22))
    shown = terminal.getvalue()
    assert "\x1b[" in shown
    assert "0.11" in shown
    assert "0.22" in shown, "the last picture is always the newest"


def test_a_meter_keeps_no_more_than_it_shows(terminal: Terminal) -> None:
    with redirect_stdout(terminal), LiveScreen("wave", DEMO) as screen:
        for second in range(100):
            screen.show(estimate(float(second)))
        assert len(screen._recent) == 11


def test_a_dumb_terminal_gets_lines(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    with redirect_stdout(terminal):
        assert isinstance(pick_screen("wave", DEMO, duration_s=None, json=False), LineScreen)


def test_a_pipe_gets_plain_lines_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    with pick_screen("wave", DEMO, duration_s=None, json=False) as screen:
        assert isinstance(screen, LineScreen)
        for number in range(61):
            screen.show(estimate(number / 30, number / 60))
    head, *lines = capsys.readouterr().out.splitlines()
    assert head == "wave: demo model m 1.2: shows how it runs, not science"
    assert [float(line.split()[0]) for line in lines] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert all(line.isprintable() and line.isascii() for line in lines)


def test_a_change_of_level_always_gets_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    with LineScreen("wave", DEMO) as screen:
        for number in range(4):
            screen.show(estimate(number / 30, level="weak" if number < 2 else "strong"))
    assert len(capsys.readouterr().out.splitlines()) == 3


def test_json_is_one_line_an_estimate_and_nothing_else(terminal: Terminal) -> None:
    many = [estimate(0.0, 0.25), estimate(0.1, None, level=None)]
    with redirect_stdout(terminal), pick_screen("wave", DEMO, duration_s=None, json=True) as screen:
        assert isinstance(screen, JsonScreen)
        for one in many:
            screen.show(one)
    assert [Estimate(**json.loads(line)) for line in terminal.getvalue().splitlines()] == many


def test_the_first_few_errors_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    complain = Complaints()
    for number in range(10):
        complain(FrameError(f"frame {number} is bad"))
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.splitlines() == [
        "fervor: frame 0 is bad",
        "fervor: frame 1 is bad",
        "fervor: frame 2 is bad",
        "fervor: more errors like this are not shown",
    ]
    assert complain.count == 10
