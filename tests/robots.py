"""A robot for tests: real qi services in a process of their own, which tell what they were told.

Run as a program it is that robot: it listens on a port, answers as its options say, and prints a line of JSON a call.
It ends when its standard input does.
"""

import importlib.util
import json
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Self

import pytest

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
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self.port = probe.getsockname()[1]
        self.url = f"tcp://127.0.0.1:{self.port}"
        self._options = {"services": services, "animations": animations, "seconds": seconds, "bare": bare}
        self._calls: queue.SimpleQueue[list[Any] | None] = queue.SimpleQueue()
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(self.port), json.dumps(self._options)],
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


# --- the robot's own process ------------------------------------------------------------------------------------------


def tell(*what: object) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def serve(port: int, options: dict[str, Any]) -> None:
    import qi

    known = set(options["animations"])
    busy = threading.Event()

    def work() -> None:
        busy.clear()
        busy.wait(options["seconds"])

    @qi.multiThreaded()  # as on the robot: it can be stopped while it speaks
    class Speech:
        def say(self, text: str) -> None:
            tell("ALTextToSpeech", "say", text)
            if "unspeakable" in text:
                raise RuntimeError("no voice\nfor this")
            work()
            tell("ALTextToSpeech", "said", text)

    @qi.multiThreaded()
    class FullSpeech(Speech):
        def setLanguage(self, name: str) -> None:
            tell("ALTextToSpeech", "setLanguage", name)
            if name == "Klingon":
                raise RuntimeError("language is not installed")

        def stopAll(self) -> None:
            tell("ALTextToSpeech", "stopAll")
            busy.set()

    @qi.multiThreaded()
    class Animated:
        def say(self, text: str) -> None:
            tell("ALAnimatedSpeech", "say", text)
            work()

    @qi.multiThreaded()
    class Player:
        def run(self, name: str) -> None:
            tell("ALAnimationPlayer", "run", name)
            if name not in known:
                raise RuntimeError(f"animation {name} does not exist")
            work()
            tell("ALAnimationPlayer", "ran", name)

    class Manager:
        def getInstalledBehaviors(self) -> list[str]:
            return sorted(known)

    class Leds:
        def fadeRGB(self, group: str, colour: int, seconds: float) -> None:
            tell("ALLeds", "fadeRGB", group, colour, seconds)

        def reset(self, group: str) -> None:
            tell("ALLeds", "reset", group)

    class Memory:
        def raiseEvent(self, name: str, value: list[str]) -> None:
            tell("ALMemory", "raiseEvent", name, list(value))

    made = {
        "ALTextToSpeech": Speech if options["bare"] else FullSpeech,
        "ALAnimatedSpeech": Animated,
        "ALAnimationPlayer": Player,
        "ALBehaviorManager": Manager,
        "ALLeds": Leds,
        "ALMemory": Memory,
    }
    qi.logging.setLevel(qi.logging.FATAL)
    session = qi.Session()
    _listen(session, f"tcp://127.0.0.1:{port}")
    kept = [made[name]() for name in options["services"]]
    for name, service in zip(options["services"], kept, strict=True):
        session.registerService(name, service)
    tell("up")
    sys.stdin.read()
    os._exit(0)  # qi's own threads would delay the end


def _listen(session: Any, url: str) -> None:
    """The port of a robot that was killed is free again only after a while."""
    for _ in range(300):
        try:
            session.listenStandalone(url)
        except RuntimeError:
            time.sleep(0.1)
        else:
            return
    sys.exit(f"can't listen on {url}")


if __name__ == "__main__":
    serve(int(sys.argv[1]), json.loads(sys.argv[2]))
