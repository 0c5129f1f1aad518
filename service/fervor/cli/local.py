"""A service of one's own: `fervor stream` and `fervor demo` start one in a process beside them where they need it.

Rules. It listens on this machine only and asks for no token. It ends with whoever started it, however that ends: it
watches its standard input, which closes with the other's death. Ctrl-C reaches the starter alone.
"""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO
from urllib.request import urlopen

from fervor.errors import FervorError
from fervor.settings import Settings

HOST = "127.0.0.1"

TOKENS = ("FERVOR_TOKENS", "FERVOR_PAGE_TOKENS")

START_S = 30.0
"""Longest wait for the service; it takes a second or two."""

STOP_S = 10.0

LOOK_S = 0.05


class NoService(FervorError):
    """The service that was started here did not get ready."""

    code = "no_service"
    exit_code = 69


@contextmanager
def own_service(port: int = 0) -> Iterator[int]:
    """A running service that is ready; yields its port, any free one for 0.

    Raises:
        NoService: it did not start; says what it said.
    """
    port = port or free_port()
    environment = {name: value for name, value in os.environ.items() if name.upper() not in TOKENS}
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(  # noqa: S603  # ourselves
            [sys.executable, "-m", __name__, str(port)],
            stdin=subprocess.PIPE,
            stdout=said,
            stderr=said,
            env=environment,
            start_new_session=True,
        ) as process,
    ):
        try:
            _wait_until_ready(process, port, said)
            yield port
        finally:
            _stop(process)


def is_free(port: int) -> bool:
    """Whether nobody listens on a port of this machine."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
    return True


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.create_server((HOST, 0)) as probe:
        return int(probe.getsockname()[1])


def _wait_until_ready(process: "subprocess.Popen[bytes]", port: int, said: IO[bytes]) -> None:
    until = time.monotonic() + START_S
    while not _is_ready(port):
        if process.poll() is not None:
            said.seek(0)
            last = said.read().decode(errors="replace").strip().rpartition("\n")[2]
            raise NoService(f"the service did not start: {last.removeprefix('fervor: ') or 'it said nothing'}")
        if time.monotonic() > until:
            raise NoService(f"the service was not ready after {START_S:g} s")
        time.sleep(LOOK_S)


def _is_ready(port: int) -> bool:
    try:
        with urlopen(f"http://{HOST}:{port}/readyz", timeout=2.0) as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


def _stop(process: "subprocess.Popen[bytes]") -> None:
    assert process.stdin is not None
    process.stdin.close()
    try:
        process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()


def _end_with_starter() -> None:
    """Stop this service gently once its standard input ends."""
    while os.read(sys.stdin.fileno(), 1):  # not sys.stdin.read: its lock would be in the way of an early exit
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def _serve(port: int) -> None:
    """What runs in the service's process."""
    from fervor.server.run import run

    settings = Settings.load(host=HOST, port=port, workers=1, log_level="warning", shutdown_grace_s=1)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    try:
        run(settings)
    except FervorError as error:
        sys.exit(f"fervor: {error.message}")


if __name__ == "__main__":
    _serve(int(sys.argv[1]))
