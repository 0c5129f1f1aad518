"""Several workers on one address: killed, replaced, drained; no stream notices."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
import websockets
from prometheus_client.parser import text_string_to_metric_families

import fervor_client
from bodies import motion
from fervor.server.supervisor import with_key
from fervor.settings import Settings
from live import PROTOCOL, Live
from program import FERVOR, fervor
from robots import Robots, assert_told_as_if_nothing_had_happened


class Served:
    """The program with two workers."""

    def __init__(self, process: "subprocess.Popen[bytes]", log: Path) -> None:
        self.process = process
        self._log = log
        self.address = self.wait_for("listening on http://").rpartition("http://")[2]
        self.url = f"http://{self.address}"
        self.stream = f"ws://{self.address}/v1/stream"

    @property
    def said(self) -> list[str]:
        return self._log.read_text(encoding="utf-8").splitlines()

    def wait_for(self, words: str) -> str:
        return until(lambda: next((line for line in self.said if words in line), ""))

    def workers(self) -> set[int]:
        """Their process numbers."""
        text = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text(encoding="ascii")
        return {int(number) for number in text.split()}

    def sessions(self) -> dict[str, float]:
        """How many are open, by worker."""
        text = httpx.get(f"{self.url}/metrics", timeout=30).text
        return {
            sample.labels["worker"]: sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
            if sample.name == "fervor_sessions"
        }


def until(look: Callable[[], Any], seconds: float = 60.0) -> Any:
    """What a look gives once it gives something."""
    deadline = time.monotonic() + seconds
    while not (seen := look()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return seen


Serve = Callable[..., AbstractContextManager[Served]]


@pytest.fixture
def served(tmp_path: Path) -> Serve:
    @contextmanager
    def serve(*options: str) -> Iterator[Served]:
        log = tmp_path / "log"
        command = [FERVOR, "serve", "--port", "0", "--workers", "2", *options]
        with log.open("wb") as said, subprocess.Popen(command, stderr=said) as process:
            try:
                yield Served(process, log)
            finally:
                process.kill()

    return serve


def is_alive(number: int) -> bool:
    with suppress(OSError):
        return "zombie" not in Path(f"/proc/{number}/status").read_text(encoding="ascii")
    return False


def test_both_workers_serve_and_each_metric_tells_of_both(served: Serve) -> None:
    with served() as service:
        assert len(service.workers()) == 2
        with Robots(service.stream, 8):
            until(lambda: sum(service.sessions().values()) == 8)
            assert len(service.sessions()) == 2
            assert all(service.sessions().values()), "eight robots all came to one of two workers"


def test_a_killed_worker_costs_no_robot_a_frame(served: Serve, live: Live) -> None:
    with served() as service, Robots(service.stream, 4) as robots:
        for victim in service.workers():  # each robot is with one of them
            os.kill(victim, signal.SIGKILL)
            until(lambda gone=victim: len(service.workers() - {gone}) == 2)
            robots.settle()
    assert all(robots.reconnects)
    assert_told_as_if_nothing_had_happened(robots, live.stream)


def test_sighup_replaces_the_workers_one_by_one_under_load(served: Serve, live: Live) -> None:
    with served() as service:
        before = service.workers()
        with Robots(service.stream, 4) as robots:
            service.process.send_signal(signal.SIGHUP)
            seen = set()
            until(lambda: seen.add(len(service.workers())) or not service.workers() & before)
            robots.settle()
        assert min(seen) >= 2
        assert len(service.workers()) == 2
    assert all(robots.reconnects)
    assert_told_as_if_nothing_had_happened(robots, live.stream)


def test_a_worker_that_is_told_to_end_leaves_the_address_to_the_others(served: Serve) -> None:
    with served() as service, fervor_client.sync.connect(service.stream) as session:
        session.estimate(motion(1)[0])
        for worker in service.workers():
            os.kill(worker, signal.SIGTERM)
            until(lambda gone=worker: len(service.workers() - {gone}) == 2)
        session.estimate(motion(1)[0])
        assert httpx.get(f"{service.url}/readyz", timeout=30).status_code == 200


async def test_sigterm_drains_all_workers_at_once_and_ends_well(served: Serve) -> None:
    with served("--drain-s", "20") as service:
        sockets = [
            await websockets.connect(service.stream, subprotocols=[PROTOCOL], compression=None) for _ in range(8)
        ]
        for socket in sockets:
            await socket.send('{"type": "session.start"}')
            await socket.recv()
        service.process.send_signal(signal.SIGTERM)
        for socket in sockets:
            assert '"going_away"' in await socket.recv()
            with pytest.raises(websockets.ConnectionClosed) as closed:
                await socket.recv()
            assert closed.value.rcvd.code == 1012
        assert service.process.wait(30) == 0
        assert not any("Traceback" in line for line in service.said)


def test_ctrl_c_as_a_terminal_sends_it_ends_all_quietly(served: Serve) -> None:
    with served() as service:
        workers = service.workers()
        for number in (service.process.pid, *workers):  # to each process of the group
            os.kill(number, signal.SIGINT)
        assert service.process.wait(30) == 130
        assert not any("Traceback" in line for line in service.said)
        assert not any(is_alive(worker) for worker in workers)


def test_workers_do_not_outlive_a_killed_supervisor(served: Serve) -> None:
    with served() as service:
        workers = service.workers()
        service.process.kill()
        until(lambda: not any(is_alive(worker) for worker in workers))


def test_what_is_wrong_with_the_model_is_said_once(tmp_path: Path) -> None:
    path = tmp_path / "bad.onnx"
    path.write_bytes(b"no model")
    ran = fervor("serve", "--port", "0", "--workers", "2", "--log-level", "warning", "--model", path)
    assert ran.returncode == 65
    assert ran.stderr.startswith(f"fervor: {path} is not an ONNX file")
    assert ran.stderr.count("\n") == 1


def test_a_model_gone_bad_leaves_the_workers_there_are(served: Serve, tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes((Path(__file__).parents[1] / "service/fervor/models/default.onnx").read_bytes())
    with served("--model", str(path)) as service:
        before = service.workers()
        path.write_bytes(b"no model")
        service.process.send_signal(signal.SIGHUP)
        service.wait_for("the others stay as they are")
        assert before <= service.workers()
        assert httpx.get(f"{service.url}/readyz", timeout=30).status_code == 200


def test_a_key_is_made_up_once_where_none_is_set() -> None:
    made = with_key(Settings.load(workers=2))
    assert len(made.checkpoint_keys[0].get_secret_value()) >= 32
    assert with_key(made) is made
