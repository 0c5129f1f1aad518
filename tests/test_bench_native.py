"""The C programs build without a warning, and say why they don't."""

import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

from fervor_bench.errors import BenchError
from fervor_bench.native import FLAGS, build


@pytest.mark.parametrize("program", FLAGS)
def test_sources_have_no_warnings(workshop: Path, tmp_path: Path, program: str) -> None:
    source = files("fervor_bench") / "native" / f"{program}.c"
    command = ["cc", *FLAGS[program], "-Wall", "-Wextra", "-Werror", "-o", str(tmp_path / program), str(source), "-lm"]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr


def test_a_program_is_built_once(workshop: Path) -> None:
    first = build("load", workshop)
    made = first.stat().st_mtime_ns
    assert build("load", workshop).stat().st_mtime_ns == made


def test_no_compiler_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BenchError, match="no C compiler `cc` is here"):
        build("load", tmp_path)


def test_a_compiler_that_refuses_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'error: no such thing' >&2\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    with pytest.raises(BenchError, match=r"can't compile load\.c: error: no such thing"):
        build("load", tmp_path)
