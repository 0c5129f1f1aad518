"""Who is measured: what starts it, and what it understands."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from pathlib import Path

from fervor.emotions import EMOTIONS
from fervor_bench.errors import BenchError
from fervor_bench.machine import pinned
from fervor_bench.native import build
from fervor_bench.traffic import Encoding

HOST = "127.0.0.1"

START_S, STOP_S = 60.0, 10.0

PAUSES = "pauses"
"""Name of the file in which a contestant in Python notes those of its collector."""

SERVICE_LIMITS = {
    "FERVOR_MAX_SESSIONS": "65536",
    "FERVOR_CAPACITY": "16384",
    "FERVOR_MAX_FRAMES_PER_SECOND": "1000000",
    "FERVOR_SCORE_MAX_BYTES": str(256 * 1_048_576),
    "FERVOR_CHECKPOINT_KEYS": "a key for measuring only",
}
"""What the service refuses by default, so that the machine is the limit."""


@dataclass(frozen=True, slots=True)
class Contestant:
    """A service that can be started here."""

    name: str
    title: str
    encodings: tuple[Encoding, ...]
    command: Callable[[Path, int], list[str]]
    """What to run, from a folder for files and the port to listen on; raises BenchError where it can't."""
    complete: bool = False
    """Whether it takes the whole protocol (any skeleton, checkpoints) and puts poses on a grid by their times."""
    groups: bool = False
    """Whether it takes several frames a message."""
    states: int = 1
    """Recurrent states that it keeps of a body."""
    http: bool = True
    """Whether /readyz says when it is ready; else it is when it listens."""


def _naive(folder: Path, port: int) -> list[str]:
    from fervor.model import default_model_path

    return [sys.executable, "-m", "fervor_bench.naive", str(port), str(default_model_path()), str(folder / PAUSES)]


def _tuned(folder: Path, port: int) -> list[str]:
    return [*_naive(folder, port), "--tuned"]


def _fervor(folder: Path, port: int) -> list[str]:
    options = ["--host", HOST, "--port", str(port), "--log-level", "warning"]
    return [sys.executable, "-m", "fervor_bench.serve", str(folder / PAUSES), *options]


def _floor(folder: Path, port: int, states: int = 1) -> list[str]:
    from fervor.model import default_model_path
    from fervor_bench.weights import write_weights

    weights = folder / "weights"
    write_weights(default_model_path(), weights)
    return [str(build("floor", folder)), str(port), str(weights), str(states), *EMOTIONS]


def _floor_two(folder: Path, port: int) -> list[str]:
    return _floor(folder, port, 2)


CONTESTANTS: Mapping[str, Contestant] = {
    contestant.name: contestant
    for contestant in (
        Contestant("naive", "FastAPI, pydantic, a model call a frame, uvicorn's defaults", ("json",), _naive),
        Contestant("naive-tuned", "the same on uvloop, httptools, sans-I/O WebSocket, one thread", ("json",), _tuned),
        Contestant("fervor", "fervor serve", ("json", "msgpack"), _fervor, complete=True, groups=True, states=2),
        Contestant("floor", "C: epoll and the network, nothing checked", ("msgpack",), _floor, groups=True, http=False),
        Contestant(
            "floor-two",
            "the same with two states a body, as the service has",
            ("msgpack",),
            _floor_two,
            groups=True,
            states=2,
            http=False,
        ),
    )
}


@dataclass(frozen=True, slots=True)
class Running:
    """A contestant that is ready."""

    host: str
    port: int
    path: str = "/v1/stream"
    token: str = ""
    pid: int | None = None
    """Its process; None where it runs elsewhere."""
    start_s: float | None = None
    """From starting the process to ready."""
    states: int = 2
    """Recurrent states that it keeps of a body; a service elsewhere is taken for one of ours."""

    @property
    def address(self) -> str:
        """HOST:PORT."""
        return f"{self.host}:{self.port}"

    @property
    def url(self) -> str:
        """The stream's."""
        return f"ws://{self.address}{self.path}"


@contextmanager
def started(contestant: Contestant, folder: Path, processor: int) -> Iterator[Running]:
    """Run a contestant on one processor until the end of the block.

    Raises:
        BenchError: it can't run here, or did not get ready; says what it said.
    """
    with socket.create_server((HOST, 0)) as probe:
        port = int(probe.getsockname()[1])
    command = contestant.command(folder, port)
    log = folder / f"{contestant.name}.log"
    (folder / PAUSES).unlink(missing_ok=True)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("FERVOR_")}
    begin = time.perf_counter()
    with log.open("wb") as said, pinned(processor):
        process = subprocess.Popen(command, stdout=said, stderr=said, env=environment | SERVICE_LIMITS)
    try:
        _wait_until_ready(contestant, process, port, log)
        start_s = time.perf_counter() - begin
        yield Running(HOST, port, pid=process.pid, start_s=start_s, states=contestant.states)
    finally:
        process.terminate()
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait_until_ready(contestant: Contestant, process: "subprocess.Popen[bytes]", port: int, log: Path) -> None:
    until = time.monotonic() + START_S
    ready = _answers_ready if contestant.http else _listens
    while not ready(port):
        if process.poll() is not None:
            last = log.read_text(encoding="utf-8", errors="replace").strip().rpartition("\n")[2]
            raise BenchError(f"{contestant.name} did not start: {last or 'it said nothing'}")
        if time.monotonic() > until:
            raise BenchError(f"{contestant.name} was not ready after {START_S:g} s")
        time.sleep(0.005)


def _answers_ready(port: int) -> bool:
    connection = HTTPConnection(HOST, port, timeout=2.0)
    try:
        connection.request("GET", "/readyz")
        return connection.getresponse().status == 200
    except (OSError, HTTPException):
        return False
    finally:
        connection.close()


def _listens(port: int) -> bool:
    try:
        socket.create_connection((HOST, port), timeout=2.0).close()
    except OSError:
        return False
    return True
