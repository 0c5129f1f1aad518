"""The service as a process: where it listens, how it starts, how it ends."""

import asyncio
import gc
import json
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
import pytest
import websockets

from bodies import motion
from fervor.server.run import COLLECTED_AFTER, AddressError, Server, bind, configure, end_well, run
from fervor.settings import Settings
from live import PROTOCOL, Live, frames_of, score_request, talk
from program import fervor, start_fervor


@contextmanager
def serving(*options: str) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """The program, and the address it listens on."""
    process = start_fervor("serve", "--port", "0", *options)
    try:
        for line in process.stderr:
            if "listening on http://" in line:
                break
        yield process, line.rstrip().rpartition("http://")[2]
    finally:
        process.kill()
        process.communicate()


# --- the address ------------------------------------------------------------------------------------------------------


def test_a_port_in_use_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(AddressError, match=f"can't listen on 127.0.0.1 port {port}: Address already in use"):
            bind("127.0.0.1", port)


def test_an_unknown_host_is_told() -> None:
    with pytest.raises(AddressError, match="can't listen on no such host port 80: "):
        bind("no such host", 80)


def test_what_is_there_before_the_first_client_is_out_of_the_collectors_way(monkeypatch: pytest.MonkeyPatch) -> None:
    frozen: list[int] = []
    usual = gc.get_threshold()
    monkeypatch.setattr("fervor.server.run.configure_logs", lambda *_: None)
    monkeypatch.setattr("fervor.server.run.end_well", lambda: None)
    monkeypatch.setattr(Server, "run", lambda *_, **__: frozen.append(gc.get_freeze_count()))
    try:
        run(Settings.load(port=0))
    finally:
        gc.unfreeze()
        seldom = gc.get_threshold()
        gc.set_threshold(*usual)
    assert seldom == COLLECTED_AFTER
    assert frozen[0] > 10_000


async def test_connections_lose_no_time_and_hang_for_no_peer(live: Live) -> None:
    async with talk(live):
        (connection,) = live._server.server_state.connections
        accepted = connection.transport.get_extra_info("socket")
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 20_000


# --- the process ------------------------------------------------------------------------------------------------------


def test_it_says_where_it_listens_once_it_does() -> None:
    with serving() as (process, address):
        assert httpx.get(f"http://{address}/readyz", timeout=30).json() == {"status": "ready"}
        process.terminate()
        assert "Shutting down" in process.stderr.read()


async def test_sigterm_closes_streams_with_1012_and_ends() -> None:
    with serving() as (process, address):
        async with websockets.connect(f"ws://{address}/v1/stream", subprotocols=[PROTOCOL]) as stream:
            await stream.send('{"type": "session.start"}')
            await stream.recv()
            process.send_signal(signal.SIGTERM)
            assert json.loads(await stream.recv())["type"] == "going_away"
            with pytest.raises(websockets.ConnectionClosed) as closed:
                await stream.recv()
            assert closed.value.rcvd.code == 1012
        assert await asyncio.to_thread(process.wait, 20) == 0
        assert "Traceback" not in process.stderr.read()


def test_an_exit_that_was_passed_over_at_the_start_is_made_up_for() -> None:
    before = signal.getsignal(signal.SIGTERM)
    try:
        told = end_well()
        with suppress(SystemExit):  # as some libraries do while they load
            signal.raise_signal(signal.SIGTERM)
        with bind("127.0.0.1", 0) as bound:
            listened: list[socket.socket] = []
            Server(configure(Settings.load()), on_listening=listened.append, told=told).run(sockets=[bound])
        assert not listened
    finally:
        signal.signal(signal.SIGTERM, before)


def test_ctrl_c_ends_it_quietly() -> None:
    with serving() as (process, address):
        assert httpx.get(f"http://{address}/healthz", timeout=30).status_code == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
        assert "Traceback" not in process.stderr.read()


def test_the_scoring_process_does_not_outlive_a_kill() -> None:
    with serving() as (process, address):
        request = json.dumps(score_request(frames_of(motion(3))))
        assert httpx.post(f"http://{address}/v1/score", content=request, timeout=60).status_code == 200
        (child,) = children(process.pid)
        process.kill()
        process.wait(20)
        deadline = time.monotonic() + 20
        while Path(f"/proc/{child}").exists() and time.monotonic() < deadline:
            os.sched_yield()
        assert not Path(f"/proc/{child}").exists()


def children(pid: int) -> list[int]:
    """Processes that a process started."""
    return [
        int(number)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for number in (task / "children").read_text(encoding="ascii").split()
    ]


def test_a_bad_model_ends_the_start_with_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "bad.onnx"
    path.write_bytes(b"no model")
    ran = fervor("serve", "--port", "0", "--model", path)
    assert ran.returncode == 65
    assert ran.stderr.startswith(f"fervor: {path} is not an ONNX file that onnxruntime can run")
    assert ran.stderr.count("\n") == 1


def test_a_port_in_use_ends_the_start_with_a_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        ran = fervor("serve", "--port", taken.getsockname()[1])
    assert ran.returncode == 69
    assert ran.stderr.startswith("fervor: can't listen on 127.0.0.1 port")
    assert ran.stderr.count("\n") == 1


def test_bad_skeletons_end_the_start_with_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text("{}", encoding="utf-8")
    ran = fervor("serve", "--port", "0", "--skeletons", tmp_path)
    assert ran.returncode == 78
    assert ran.stderr == f"fervor: {tmp_path / 'mine.json'} is not a skeleton: name is missing\n"
