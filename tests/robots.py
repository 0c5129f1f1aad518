"""A robot for tests: real qi services in a process of their own (qi_services.py), which tell what they were told."""

import importlib.util
import json
import os
import queue
import random
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import pytest

PROGRAM = Path(__file__).with_name("qi_services.py")

HAPPY = "animations/Stand/Emotions/Positive/Happy_4"
SERVICES = (
    "ALTextToSpeech",
    "ALAnimatedSpeech",
    "ALAnimationPlayer",
    "ALBehaviorManager",
    "ALLeds",
    "ALMemory",
)


def need_qi() -> None:
    """Skip where qi can't be installed; never in CI."""
    if importlib.util.find_spec("qi") is None:
        if os.environ.get("CI"):
            pytest.fail("qi is not installed")
        pytest.skip("qi is not installed")


def free_port() -> int:
    """A free port that no outgoing connection is given, so that a robot that was killed can have it again."""
    while True:
        with suppress(OSError), socket.create_server(("127.0.0.1", random.randrange(20_000, 32_000))) as probe:
            return int(probe.getsockname()[1])


class QiRobot:
    """The process, seen from the test. Use it in a `with`; `kill` and `start` it at will."""

    def __init__(
        self,
        *,
        services: tuple[str, ...] = SERVICES,
        animations: tuple[str, ...] = (HAPPY,),
        seconds: float = 0.0,
        bare: bool = False,
    ) -> None:
        """`seconds`: how long speech and gestures take. `bare`: services have no methods but say and run."""
        self.port = free_port()
        self.url = f"tcp://127.0.0.1:{self.port}"
        self._options = {"services": services, "animations": animations, "seconds": seconds, "bare": bare}
        self._calls: queue.SimpleQueue[list[Any] | None] = queue.SimpleQueue()
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self.calls()  # what one that was killed still said is nobody's
        self._process = subprocess.Popen(
            [sys.executable, str(PROGRAM), str(self.port), json.dumps(self._options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, args=(self._process,), daemon=True)
        self._reader.start()
        assert self.next_call() == ["up"]

    def kill(self) -> None:
        """The robot is gone without a word."""
        assert self._process is not None
        self._process.send_signal(signal.SIGKILL)
        self._over()

    def freeze(self, *, thaw: bool = False) -> None:
        """The robot keeps its connection and says nothing."""
        assert self._process is not None
        self._process.send_signal(signal.SIGCONT if thaw else signal.SIGSTOP)

    def next_call(self, seconds: float = 30.0) -> list[Any]:
        """What it was told next: service, method, arguments."""
        call = self._calls.get(timeout=seconds)
        assert call is not None, "the robot ended"
        return call

    def calls_until(self, *last: str, seconds: float = 60.0) -> Iterator[list[Any]]:
        """All calls up to the first of these methods."""
        while True:
            call = self.next_call(seconds)
            yield call
            if call[1] in last:
                return

    def calls(self) -> list[list[Any]]:
        """What it was told and nobody looked at yet."""
        found = []
        with suppress(queue.Empty):
            while (call := self._calls.get_nowait()) is not None:
                found.append(call)
        return found

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGCONT)
            self._process.kill()
        self._over()

    def _over(self) -> None:
        assert self._process is not None
        self._process.wait(30)
        self._reader.join(30)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError):
                pipe.close()

    def _read(self, process: "subprocess.Popen[str]") -> None:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("["):
                with suppress(ValueError):  # a line of qi's own log
                    self._calls.put(json.loads(line))
