"""The program itself: what it says when something is missing or goes wrong, and with which exit code."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
import typer

from fervor import __version__
from fervor.cli import commands
from fervor.cli.main import run
from fervor.errors import AuthError
from program import FERVOR

GROUP = commands.GROUP


@pytest.fixture
def others(monkeypatch: pytest.MonkeyPatch) -> list[EntryPoint]:
    """Commands that other distributions bring."""
    points: list[EntryPoint] = []
    monkeypatch.setattr(commands, "entry_points", lambda group: points if group == GROUP else [])
    return points


def greet(name: str, *, loudly: bool = False) -> None:
    """Say hello."""
    typer.echo(f"hello {name}{'!' if loudly else ''}")


def needs_more() -> None:
    """Import something that is not there, but only when called."""
    import no_such_package  # noqa: F401


def is_not_ours() -> None:
    raise AssertionError("ours was replaced")


def wants_a_token() -> None:
    raise AuthError("this service needs a token")


def is_interrupted() -> None:
    raise KeyboardInterrupt


app = typer.Typer()
app.command("one")(lambda: typer.echo("one"))
app.command("two")(lambda: typer.echo("two"))


def point(name: str, attribute: str, extra: str = "") -> EntryPoint:
    return EntryPoint(name, f"{__name__}:{attribute}{extra}", GROUP)


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"fervor {__version__}\n"


def test_the_help_names_every_command(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("greet", "greet"))
    assert run(["--help"]) == 0
    shown = capsys.readouterr().out
    for name in ("serve", "stream", "score", "inspect", "demo", "greet", "Say hello."):
        assert name in shown


def test_an_unknown_command(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["dance"]) == 2
    assert "No such command 'dance'" in capsys.readouterr().err


def test_a_function_from_elsewhere(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("greet", "greet"))
    assert run(["greet", "Pepper", "--loudly"]) == 0
    assert capsys.readouterr().out == "hello Pepper!\n"


def test_a_group_from_elsewhere(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("count", "app"))
    assert run(["count", "two"]) == 0
    assert capsys.readouterr().out == "two\n"


def test_ours_cannot_be_replaced(others: list[EntryPoint]) -> None:
    others.append(point("inspect", "is_not_ours"))
    assert commands.find_commands()["inspect"].value.startswith("fervor.cli.inspect")


def test_only_the_command_called_is_imported(others: list[EntryPoint]) -> None:
    others.append(EntryPoint("broken", "fervor.no_such_module:x", GROUP))
    assert run(["inspect", "--help"]) == 0
    with pytest.raises(ModuleNotFoundError, match=r"fervor\.no_such_module"):
        run(["broken"])


# --- what is missing --------------------------------------------------------------------------------------------------


def test_a_command_without_its_extra_says_so(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(EntryPoint("train", "no_such_package.commands:app [train]", GROUP))
    assert run(["--help"]) == 0
    assert 'Needs pip install "fervor[train]"' in capsys.readouterr().out
    assert run(["train", "--epochs", "3", "data"]) == 69
    told = capsys.readouterr().err
    assert told == 'fervor: this needs no_such_package, which is not installed: pip install "fervor[train]"\n'


def test_so_does_one_that_finds_out_late(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("late", "needs_more", " [serve]"))
    assert run(["late"]) == 69
    told = capsys.readouterr().err
    assert told == 'fervor: this needs no_such_package, which is not installed: pip install "fervor[serve]"\n'


def test_training_without_its_extra(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    assert run(["train"]) == 69
    told = capsys.readouterr().err
    assert told == 'fervor: this needs torch, which is not installed: pip install "fervor[train]"\n'


def test_without_an_extra_the_package_is_named(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("late", "needs_more"))
    assert run(["late"]) == 69
    assert capsys.readouterr().err.endswith("not installed: pip install no_such_package\n")


def test_without_the_command_line_itself() -> None:
    code = "import sys; sys.modules['typer'] = None; from fervor.cli.main import run; sys.exit(run(['serve']))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 69
    assert ran.stderr == 'fervor: the command line needs typer, which is not installed: pip install "fervor[serve]"\n'


# --- what goes wrong --------------------------------------------------------------------------------------------------


def test_an_error_is_a_sentence_and_a_code(others: list[EntryPoint], capsys: pytest.CaptureFixture[str]) -> None:
    others.append(point("private", "wants_a_token"))
    assert run(["private"]) == 77
    assert capsys.readouterr().err == "fervor: this service needs a token\n"


def test_ctrl_c_is_130(others: list[EntryPoint]) -> None:
    others.append(point("long", "is_interrupted"))
    assert run(["long"]) == 130


def test_a_closed_pipe_ends_it_quietly() -> None:
    shell = f"set -o pipefail; {FERVOR} inspect --json | true"
    ran = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, timeout=60, check=False)
    assert ran.stderr == ""
    assert ran.returncode in (0, 1, 141)  # 0 where the pipe still took it all
