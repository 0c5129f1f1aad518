"""A Docker of the tests' own: a private daemon whose every folder is temporary, and images under the official names.

Images can't be pulled everywhere that these tests run, so stand-ins are made from Debian packages: for `PYTHON_IMAGE`
what the Dockerfile builds on, and one with haproxy and Prometheus for the other services of compose.yaml.
"""

import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from pages import ROOT
from waiting import until

PYTHON_IMAGE = "python:3.11-slim"

NEEDED = ("dockerd", "mmdebstrap", "docker-compose")

CERTIFICATES = "/etc/ssl/certs/ca-certificates.crt"

STAND_IN = f"""
FROM {PYTHON_IMAGE}
RUN apt-get update -qq && apt-get install -qq --no-install-recommends haproxy prometheus
"""

HAPROXY = "FROM stand-in\nCMD haproxy -W -db -f /usr/local/etc/haproxy/haproxy.cfg\n"
PROMETHEUS = (
    "FROM stand-in\nCMD prometheus --config.file=/etc/prometheus/prometheus.yml --storage.tsdb.path=/tmp/data\n"
)


def which(program: str) -> str | None:
    """Where a program is, those of root and of the environment of the tests included."""
    places = [str(Path(sys.executable).parent), os.environ.get("PATH", ""), "/usr/sbin", "/usr/bin"]
    return shutil.which(program, path=os.pathsep.join(places))


def need(*programs: str) -> None:
    """Skip where a program is missing; in CI, where .ci/install has installed all, fail."""
    for program in programs:
        if which(program) is None:
            _do_without(program)


def need_root() -> None:
    """Skip where a daemon can't be started; in CI, fail."""
    if os.geteuid() != 0:
        _do_without("root's right to start a Docker daemon", how="these tests run as root")


def need_module(name: str) -> ModuleType:
    """Import what the extra `deploy` brings; skip where it is missing, but in CI."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        _do_without(name)
        raise


def _do_without(name: str, *, how: str = ".ci/install installs what these tests need") -> None:
    sentence = f"{name} is not there; {how}"
    if os.environ.get("CI"):
        pytest.fail(sentence)
    pytest.skip(sentence)


class Docker:
    """The command line, for one daemon."""

    def __init__(self, home: Path) -> None:
        daemon = which("dockerd")
        assert daemon is not None
        beside = Path(daemon).parents[1] / "bin" / "docker"  # the client that came with the daemon
        self.program = str(beside) if beside.exists() else str(which("docker"))
        plugins = home / "config" / "cli-plugins"
        plugins.mkdir(parents=True)
        (plugins / "docker-compose").symlink_to(str(which("docker-compose")))
        self.environment = {
            **os.environ,
            "DOCKER_HOST": f"unix://{home / 'socket'}",
            "DOCKER_CONFIG": str(home / "config"),
            "DOCKER_BUILDKIT": "1",
        }

    def __call__(
        self, *arguments: object, stdin: str = "", check: bool = True, together: bool = False, **more: str
    ) -> str:
        """Run a command, with `more` in its environment; what it printed, its errors too where `together`."""
        command = [self.program, *map(str, arguments)]
        environment = {**self.environment, **more}
        done = subprocess.run(
            command, input=stdin, capture_output=True, text=True, check=False, timeout=300, env=environment
        )
        assert not check or done.returncode == 0, f"docker {arguments}: {done.stdout}\n{done.stderr}"
        return (done.stdout + done.stderr * together).strip()

    def logs(self, container: str) -> str:
        """What it wrote."""
        return self("logs", container, together=True)

    def inspect(self, name: str) -> dict[str, Any]:
        """All that is known of a container or image."""
        found: dict[str, Any] = json.loads(self("inspect", name))[0]
        return found

    def address(self, container: str) -> str:
        """Where it is on its network."""
        (network,) = self.inspect(container)["NetworkSettings"]["Networks"].values()
        return str(network["IPAddress"])

    def wait_healthy(self, container: str) -> None:
        """Wait until its health check passes."""
        until(lambda: self.inspect(container)["State"]["Health"]["Status"] == "healthy")


@contextmanager
def running_docker(home: Path) -> Iterator[Docker]:
    """A daemon of one's own; everything of it is gone afterwards."""
    docker = Docker(home)
    folders = ("--data-root", home / "data", "--exec-root", home / "exec", "--pidfile", home / "pid")
    with (home / "log").open("wb") as log:
        process = subprocess.Popen(
            [str(which("dockerd")), *map(str, folders), "-H", docker.environment["DOCKER_HOST"]],
            stdin=subprocess.DEVNULL, stdout=log, stderr=log,
        )  # fmt: skip
    try:
        until(lambda: process.poll() is not None or docker("version", "--format", "{{.Server.Version}}", check=False))
        assert process.poll() is None, (home / "log").read_text(encoding="utf-8")[-2000:]
        yield docker
    finally:
        if ids := docker("ps", "--all", "--quiet", check=False).split():
            docker("rm", "--force", "--volumes", *ids, check=False)
        process.send_signal(signal.SIGTERM)
        process.wait(60)


@contextmanager
def roomy_folder() -> Iterator[Path]:
    """A temporary folder for images: in memory where there is plenty, for images are many small files."""
    memory = Path("/dev/shm")
    plenty = memory.is_dir() and shutil.disk_usage(memory).free > 8 << 30
    folder = Path(tempfile.mkdtemp(prefix="fervor-docker-", dir=memory if plenty else None))
    folder.chmod(0o755)  # mmdebstrap's unprivileged helpers look inside
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def make_images(docker: Docker, folder: Path) -> None:
    """The stand-ins, and the project's own image from its Dockerfile."""
    base = folder / "base.tar"
    hooks = (
        f'cp {CERTIFICATES} "$1{CERTIFICATES}"',
        'rm -f "$1"/usr/lib/python3*/EXTERNALLY-MANAGED && ln -s python3 "$1/usr/bin/python"',
    )
    packages = "python3-minimal,python3-pip,python3-venv,ca-certificates"
    subprocess.run(
        ["mmdebstrap", "--quiet", "--variant=minbase", f"--include={packages}",
         *(f"--customize-hook={hook}" for hook in hooks), "bookworm", str(base)],
        check=True, timeout=300, env={**os.environ, "TMPDIR": str(folder)},
    )  # fmt: skip
    trust = f"ENV PIP_CERT={CERTIFICATES} SSL_CERT_FILE={CERTIFICATES}"
    docker("import", "--change", trust, base, PYTHON_IMAGE)
    base.unlink()
    for tag, dockerfile in (("stand-in", STAND_IN), *zip(other_images(), (HAPROXY, PROMETHEUS), strict=True)):
        docker("build", "--quiet", "--tag", tag, "-", stdin=dockerfile)
    docker("build", "--quiet", "--tag", "fervor", ROOT)


def other_images() -> tuple[str, str]:
    """The names of haproxy's and Prometheus' images in compose.yaml."""
    lines = (ROOT / "compose.yaml").read_text(encoding="utf-8").splitlines()
    found = {line.split("/")[-1].split(":")[-2].strip(): line.split(": ")[1] for line in lines if "image: " in line}
    return found["haproxy"], found["prometheus"]


class Compose:
    """A project of compose.yaml, with another file of deploy/ on top if wanted."""

    def __init__(self, docker: Docker, name: str, *profiles: str, file: str | None = None, **variables: object) -> None:
        self._docker = docker
        files = ["compose.yaml", *([f"deploy/{file}"] if file else [])]
        chosen = [word for profile in profiles for word in ("--profile", profile)]
        chosen += [word for each in files for word in ("--file", str(ROOT / each))]
        self._start = ("compose", "--project-name", name, "--project-directory", ROOT, *chosen)
        self._variables: Mapping[str, str] = {key: str(value) for key, value in variables.items()}

    def __call__(self, *arguments: object) -> str:
        """Run a command of Compose."""
        return self._docker(*self._start, *arguments, **self._variables)

    @contextmanager
    def up(self, *services: str) -> Iterator["Compose"]:
        """The project, running and healthy."""
        try:
            self("up", "--detach", "--no-build", "--wait", *services)
            yield self
        finally:
            self("down", "--timeout", "1", "--volumes")

    def containers(self, service: str) -> list[str]:
        """Those of a service."""
        return self("ps", "--all", "--quiet", service).split()
