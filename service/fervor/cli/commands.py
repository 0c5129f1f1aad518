"""Which commands the `fervor` program has, and where they come from.

Rules. A command is an entry point: a function, or a `typer.Typer` with commands of its own. Ours are named here; other
floors and other distributions bring theirs under the entry point group `GROUP`. Only the command that is called is
imported, all of them only for the help. One whose extra is not installed stays in the help and says what it needs.
"""

import gc
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated

import typer

from fervor import __version__
from fervor.errors import FervorError

GROUP = "fervor.commands"
"""Entry point group of commands from elsewhere."""

OURS = tuple(
    EntryPoint(name, f"fervor.cli.{name}:{name}", GROUP)
    for name in ("serve", "stream", "score", "convert", "calibrate", "inspect", "demo")
)

OWN_PACKAGES = frozenset({"fervor", "fervor_client", "fervor_export", "fervor_bench", "fervor_pepper"})
"""A module missing from one of these is a fault of ours, not an extra that is not installed."""

EXTRAS = {"fervor": "serve", "fervor_export": "train", "fervor_bench": "bench", "fervor_pepper": "study"}
"""The extra that brings what a package of ours needs."""

ANYTHING = {"allow_extra_args": True, "ignore_unknown_options": True}


class MissingExtra(FervorError):
    """A command needs a package that is not installed."""

    code = "missing_extra"
    exit_code = 69


def find_commands() -> dict[str, EntryPoint]:
    """All commands by name: ours first, then those of others; nobody can replace ours."""
    found = {point.name: point for point in OURS}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        found.setdefault(point.name, point)
    return found


def build_app(arguments: Sequence[str]) -> typer.Typer:
    """The program as far as `arguments` need it: the one command they name, or all of them."""
    app = typer.Typer(
        name="fervor", add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, callback=_fervor
    )
    commands = find_commands()
    called = commands.get(next((word for word in arguments if not word.startswith("-")), ""))
    for point in commands.values() if called is None else (called,):
        _add(app, point)
    return app


def what_is_missing(error: ModuleNotFoundError, point: EntryPoint | None) -> MissingExtra | None:
    """The error to show where an import failed for want of an extra; None where the fault is our own."""
    missing = (error.name or "").partition(".")[0]
    if not missing or missing in OWN_PACKAGES:
        return None
    return MissingExtra(f"this needs {missing}, which is not installed: {_remedy(point, missing)}")


def _add(app: typer.Typer, point: EntryPoint) -> None:
    try:
        command = point.load()
    except ModuleNotFoundError as error:
        missing = what_is_missing(error, point)
        if missing is None:
            raise
        command = _stand_in(missing)
        app.command(point.name, help=_escape(f"Needs {_remedy(point, '')}"), context_settings=ANYTHING)(command)
        return
    if isinstance(command, typer.Typer):
        app.add_typer(command, name=point.name)
    else:
        app.command(point.name)(command)


def _stand_in(missing: MissingExtra) -> Callable[[], None]:
    def say_what_is_missing() -> None:
        raise missing

    return say_what_is_missing


def _remedy(point: EntryPoint | None, package: str) -> str:
    """What to type so that a command's packages are there."""
    extra = _extra(point) if point else "serve"
    return f'pip install "{_distribution(point)}[{extra}]"' if extra else f"pip install {package}"


def _extra(point: EntryPoint) -> str | None:
    """The extra that an entry point names, or the one that its package needs."""
    return point.extras[0] if point.extras else EXTRAS.get(point.module.partition(".")[0])


def _distribution(point: EntryPoint | None) -> str:
    return point.dist.name if point is not None and point.dist is not None else "fervor"


def _escape(text: str) -> str:
    """Square brackets kept from rich, which would take them for markup."""
    return text.replace("[", r"\[")


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fervor {__version__}")
        raise typer.Exit


def _fervor(
    version: Annotated[  # noqa: ARG001  # its callback acts on it
        bool, typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Live emotional intensity from body poses, for robots."""
    if not gc.isenabled():  # `main` loads without it
        gc.freeze()
        gc.enable()
