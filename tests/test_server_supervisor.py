"""Several workers on one address: killed, stuck, replaced, drained; no stream notices."""

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
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
from workers import Served, is_alive, served

A_FEW = 4
"""Sessions that a worker may have more than another: they come and are told of from many sides at once."""


@asynccontextmanager
async def crowded(service: Served, sessions: int) -> AsyncIterator[None]:
    """So many sessions, opened all at once."""

    async def connect() -> websockets.ClientConnection:
        return await websockets.connect(
            service.stream, subprotocols=[PROTOCOL], compression=None, open_timeout=60, close_timeout=1
        )

    sockets = await asyncio.gather(*(connect() for _ in range(sessions)))
    try:
        yield
    finally:
        await asyncio.gather(*(socket.close() for socket in sockets))


def opened(service: Served, sessions: int) -> list[float]:
    """What each worker has, if they have so many together."""
    counts = list(service.sessions().values())
    return counts if sum(counts) == sessions else []


def test_both_workers_serve_and_each_metric_tells_of_both(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        assert len(service.workers()) == 2
        with Robots(service.stream, 8):
            until(lambda: sum(service.sessions().values()) == 8)
            assert list(service.sessions().values()) == [4, 4]


@pytest.mark.parametrize("workers", [2, 4])
async def test_sessions_that_come_at_once_fall_to_all_workers_alike(tmp_path: Path, workers: int) -> None:
    with served(tmp_path, workers=workers) as service:
        async with crowded(service, 200):
            counts = await asyncio.to_thread(until, lambda: opened(service, 200))
    assert len(counts) == workers
    assert max(counts) - min(counts) <= A_FEW


async def test_a_new_worker_takes_what_comes_until_it_has_as_many(tmp_path: Path) -> None:
    with served(tmp_path) as service:
        async with crowded(service, 60):
            os.kill(service.workers().pop(), signal.SIGKILL)
            await asyncio.to_thread(until, lambda: len(service.sessions()) == 2 and opened(service, 30))
            async with crowded(service, 30):
                counts = await asyncio.to_thread(until, lambda: opened(service, 60))
    assert max(counts) - min(counts) <= A_FEW


async def test_workers_that_are_stuck_cost_who_comes_a_moment(tmp_path: Path) -> None:
    with served(tmp_path, workers=3) as service:
        first, second, _ = service.workers()
        async with crowded(service, 6):
            for number in (first, second):
                os.kill(number, signal.SIGSTOP)
            async with crowded(service, 10):  # long before the two are killed
                assert {first, second} <= service.workers()


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
