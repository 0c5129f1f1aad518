"""Where a picture is to be written, looked at before anything is recorded for it."""

from importlib.util import find_spec
from pathlib import Path

import typer

from fervor.cli.commands import MissingExtra
from fervor.cli.reports import CannotWrite


def check_target(path: Path, *suffixes: str, option: str) -> None:
    """Make sure that a picture can be drawn and written, as far as that can be known beforehand.

    Args:
        path: the file to write.
        suffixes: what its name may end in.
        option: that named it.

    Raises:
        BadParameter: its name says no format that can be drawn.
        CannotWrite: its folder is not there.
        MissingExtra: nothing is installed to draw with.
    """
    if path.suffix.lower() not in suffixes:
        raise typer.BadParameter(f"{path} must end in {' or '.join(suffixes)}", param_hint=option)
    if not path.absolute().parent.is_dir():
        raise CannotWrite(f"{path} can't be written: its folder is not there")
    if find_spec("matplotlib") is None:
        raise MissingExtra(f'{option} needs matplotlib, which is not installed: pip install "fervor[plot]"')


def write(path: Path, content: bytes) -> None:
    """Write a file whole.

    Raises:
        CannotWrite: it can't be.
    """
    try:
        path.write_bytes(content)
    except OSError as error:
        raise CannotWrite(f"{path} can't be written: {error.strerror or error}") from None
