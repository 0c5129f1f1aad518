"""The JavaScript client as its users get it: built, packed, installed into a folder, and run there by Node."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import browser

ROOT = Path(__file__).resolve().parents[1]
CLIENT = ROOT / "clients" / "js"
SCRIPTS = CLIENT / "test" / "scripts"
ENVIRONMENT = {
    **os.environ,
    "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",  # where .ci/install may put a Node
    "FERVOR_PYTHON": sys.executable,
}


def run(*command: object, cwd: Path, timeout: float = 110) -> str:
    """What a command prints; it must not fail."""
    done = subprocess.run(
        [*map(str, command)], cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True, timeout=timeout, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def node_is_here() -> bool:
    path = ENVIRONMENT["PATH"]
    if shutil.which("node", path=path) is None or shutil.which("npm", path=path) is None:
        return False
    return int(run("node", "--print", "process.versions.node.split('.')[0]", cwd=ROOT)) >= 20


@pytest.fixture(scope="session")
def built() -> Path:
    """The client's folder, built; skips where there is no Node 20 or newer, except in CI."""
    if not node_is_here():
        if os.environ.get("CI"):
            pytest.fail("no Node is here")
        pytest.skip("no Node is here")
    run("make", "--no-print-directory", "js", cwd=ROOT)
    return CLIENT


@pytest.fixture(scope="session")
def desk(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the packed client is installed, and nothing else."""
    folder = tmp_path_factory.mktemp("js")
    packed = json.loads(run("npm", "pack", "--json", "--pack-destination", folder, cwd=built))
    (folder / "package.json").write_text('{"type": "module", "private": true}')
    run("npm", "install", "--offline", "--no-audit", "--no-fund", folder / packed[0]["filename"], cwd=folder)
    for script in SCRIPTS.iterdir():
        shutil.copy(script, folder)
    return folder


@pytest.fixture(scope="session")
def chromium() -> str:
    """The browser; skips where there is none, except in CI."""
    found = browser.chromium()
    if found is None:
        if os.environ.get("CI"):
            pytest.fail("no Chromium is here")
        pytest.skip("no Chromium is here")
    return found


class Script:
    """A script of Node's that runs, and that says what it does in lines of JSON."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process
        self.said: list[Any] = []

    def hear(self, *, has: str) -> Any:
        """The next message with this key."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(json.loads(line))
            if has in self.said[-1]:
                return self.said[-1]
        assert self.process.stderr is not None
        raise AssertionError(f"the script ended: {self.said[-3:]} {self.process.stderr.read()}")

    def tell(self, line: str = "") -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()


@contextmanager
def script(desk: Path, name: str, *arguments: object) -> Iterator[Script]:
    """Run a script; it must end by itself, and well."""
    process = subprocess.Popen(
        ["node", name, *map(str, arguments)],
        cwd=desk,
        env=ENVIRONMENT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield Script(process)
        out, errors = process.communicate(timeout=60)
        assert process.returncode == 0, f"{out}{errors}"
        assert not errors, errors
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
