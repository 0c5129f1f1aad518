"""Several workers on one address: killed, stuck, replaced, drained; no stream notices."""

import os
import signal
from pathlib import Path

import httpx
import pytest
import websockets

from crowd import Robots, assert_told_as_if_nothing_had_happened
from fervor.model import default_model_path
from fervor.server.supervisor import with_key
from fervor.settings import Settings
from live import PROTOCOL, Live
from program import fervor
from waiting import until
from workers import is_alive, served


def test_both_workers_serve_and_each_metric_tells_of_both(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        assert len(service.workers()) == 2
        with Robots(service.stream, 8):
            until(lambda: sum(service.sessions().values()) == 8)
            assert len(service.sessions()) == 2
            assert all(service.sessions().values()), "eight robots all came to one of two workers"


def test_a_killed_worker_costs_no_robot_a_frame(tmp_path: Path, live: Live) -> None:
    with served(tmp_path) as service, Robots(service.stream, 4) as robots:
        for victim in service.workers():  # each robot is with one of them
            os.kill(victim, signal.SIGKILL)
            until(lambda gone=victim: len(service.workers() - {gone}) == 2)
            robots.settle()
    assert all(robots.reconnects)
    assert_told_as_if_nothing_had_happened(robots, live.stream)


def test_a_stuck_worker_is_replaced(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        stuck, other = service.workers()
        os.kill(stuck, signal.SIGSTOP)
        until(lambda: len(service.workers() - {stuck}) == 2)
        assert other in service.workers()
        assert any(f"process {stuck}) is stuck" in line for line in service.said)


def test_sighup_replaces_the_workers_one_by_one_under_load(tmp_path: Path, live: Live) -> None:
    with served(tmp_path) as service:
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


async def test_sigterm_drains_all_workers_at_once_and_ends_well(tmp_path: Path) -> None:
    with served(tmp_path, "--drain-s", "20") as service:
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


def test_ctrl_c_as_a_terminal_sends_it_ends_all_quietly(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        workers = service.workers()
        for number in (service.process.pid, *workers):  # to each process of the group
            os.kill(number, signal.SIGINT)
        assert service.process.wait(30) == 130
        assert not any("Traceback" in line for line in service.said)
        assert not any(is_alive(worker) for worker in workers)


def test_what_is_wrong_with_the_model_is_said_once(tmp_path: Path) -> None:
    path = tmp_path / "bad.onnx"
    path.write_bytes(b"no model")
    ran = fervor("serve", "--port", "0", "--workers", "2", "--log-level", "warning", "--model", path)
    assert ran.returncode == 65
    assert ran.stderr.startswith(f"fervor: {path} is not an ONNX file")
    assert ran.stderr.count("\n") == 1


def test_a_model_gone_bad_leaves_the_workers_there_are(tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(default_model_path().read_bytes())
    with served(tmp_path, "--model", str(path)) as service:
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
