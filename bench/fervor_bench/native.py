"""The two C programs, compiled where and when they are needed: `load` and `floor`."""

import shutil
import subprocess
from importlib.resources import as_file, files
from pathlib import Path

from fervor_bench.errors import BenchError

FLAGS = {
    "load": ("-O2",),
    "floor": ("-O3", "-march=native", "-ffast-math"),
}
"""Of each program; the floor is as fast as a compiler makes it for this processor."""


def compiler() -> str | None:
    """The C compiler of this machine, or None."""
    return shutil.which("cc")


def build(program: str, folder: Path) -> Path:
    """Compile a program of `FLAGS` into a folder; one that is there already is taken.

    Raises:
        BenchError: there is no C compiler, or it refuses; says what it said.
    """
    made = folder / program
    if made.exists():
        return made
    cc = compiler()
    if cc is None:
        raise BenchError("the load generator is a C program, and no C compiler `cc` is here: install gcc or clang")
    with as_file(files("fervor_bench") / "native") as sources:
        command = [cc, *FLAGS[program], "-o", str(made), str(sources / f"{program}.c"), "-lm"]
        told = subprocess.run(command, capture_output=True, text=True, check=False)
    if told.returncode:
        raise BenchError(f"{cc} can't compile {program}.c: {told.stderr.strip().partition(chr(10))[0]}")
    return made
