import os
import signal
import socket
import subprocess
import sys

import pytest

import fervor_client
from fervor.cli.local import HOST, NoService, free_port, is_free, own_service


def test_a_service_of_one_s_own_is_ready_and_gone_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_TOKENS", "nobody-knows")
    with own_service() as port:
        assert not is_free(port)
        with fervor_client.sync.connect(f"ws://{HOST}:{port}") as session:
            assert session.estimate([[0.0, 0.0, 0.0, 1.0]] * 13).seq == 0
    assert is_free(port)


def test_it_says_why_it_did_not_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FERVOR_MODEL", "/nowhere/model.onnx")
    with pytest.raises(NoService, match=r"the service did not start: .*/nowhere/model\.onnx"), own_service():
        pytest.fail("it did start")


def test_a_taken_port_is_told_from_a_free_one() -> None:
    with socket.create_server((HOST, 0)) as taken:
        assert not is_free(taken.getsockname()[1])
    assert is_free(free_port())


def test_it_ends_with_its_starter_however_that_ends() -> None:
    code = (
        "import sys\n"
        "from fervor.cli.local import own_service\n"
        "with own_service() as port:\n"
        "    print(port, flush=True)\n"
        "    sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as starter:
        assert starter.stdout is not None
        port = int(starter.stdout.readline())
        with fervor_client.sync.connect(f"ws://{HOST}:{port}", resume=False) as session:
            os.kill(starter.pid, signal.SIGKILL)
            with pytest.raises(fervor_client.Unreachable, match="code 1012"):
                session.recv(timeout=20)
