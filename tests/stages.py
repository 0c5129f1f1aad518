"""ROS for tests: the node as it is installed, and a stage around it (ros2_stage.py), each in a process of its own."""

import json
import os
import queue
import random
import signal
import subprocess
import threading
from functools import cache
from pathlib import Path
from typing import Any, Self

import pytest

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv-ros"
INSTALL = VENV / "install"
STAGE = Path(__file__).with_name("ros2_stage.py")

SECONDS = 60.0
"""Longest wait for anything: other tests may have the machine."""


@cache
def need_ros() -> None:
    """Skip where the ROS environment was never built, except in CI; build anew what has changed since."""
    if not (VENV / "built.stamp").exists():
        if os.environ.get("CI"):
            pytest.fail("the ROS environment is not built")
        pytest.skip("the ROS environment is not built: clients/ros2/testbed/build")
    subprocess.run([ROOT / "clients" / "ros2" / "testbed" / "build"], check=True, capture_output=True)


def environment(domain: int) -> dict[str, str]:
    """As `source install/setup.sh` would leave it, in a domain of its own on this machine alone."""
    return {
        **{name: value for name, value in os.environ.items() if not name.startswith(("FERVOR_", "ROS_", "PYTHON"))},
        "PATH": f"{VENV / 'bin'}:{os.environ['PATH']}",
        "AMENT_PREFIX_PATH": f"{INSTALL}:{VENV}",
        "LD_LIBRARY_PATH": f"{INSTALL / 'lib'}:{VENV / 'lib'}",
        "PYTHONPATH": str(next(INSTALL.glob("lib/python3.*/site-packages"))),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain),
    }


class _Process:
    """A process that ends with its `with`."""

    def __init__(self, command: list[str], domain: int) -> None:
        self.process = subprocess.Popen(
            command,
            env=environment(domain),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.complaints: list[str] = []
        self._readers = [
            threading.Thread(target=self._hear, daemon=True),
            threading.Thread(target=self._hear_complaints, daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for reader in self._readers:
            reader.join()
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()

    def end(self, sign: signal.Signals) -> int:
        """Tell it to stop; its exit code."""
        self.process.send_signal(sign)
        return self.process.wait(SECONDS)

    def _hear(self) -> None:
        for line in self.process.stdout or ():
            self.take(line)

    def _hear_complaints(self) -> None:
        self.complaints.extend(self.process.stderr or ())

    def take(self, line: str) -> None:
        """A line that it said."""


class RosNode(_Process):
    """The node, with parameters."""

    def __init__(self, domain: int, *arguments: str, **parameters: Any) -> None:
        settings = [part for name, value in parameters.items() for part in ("-p", f"{name}:={json.dumps(value)}")]
        program = str(INSTALL / "lib" / "fervor_ros" / "fervor_node")
        super().__init__([program, "--ros-args", *arguments, *settings], domain)


class RosStage(_Process):
    """The stage. What is heard on a topic waits until it is asked for."""

    def __init__(self, domain: int | None = None) -> None:
        self.domain = random.randrange(1, 102) if domain is None else domain
        self._heard: dict[str, queue.SimpleQueue[dict[str, Any]]] = {}
        self._answers: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        super().__init__([str(VENV / "bin" / "python"), str(STAGE), str(INSTALL)], self.domain)
        assert self._answers.get(timeout=SECONDS) == {"up": True}

    def take(self, line: str) -> None:
        said = json.loads(line)
        if "topic" in said:
            self._heard[said["topic"]].put(said["message"])
        else:
            self._answers.put(said)

    def order(self, order: str, **arguments: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([order, arguments]) + "\n")
        self.process.stdin.flush()

    def advertise(self, topic: str, kind: str, **quality: bool) -> None:
        self.order("advertise", topic=topic, kind=kind, **quality)

    def publish(self, topic: str, **fields: Any) -> None:
        self.order("publish", topic=topic, fields=fields)

    def await_listener(self, topic: str) -> None:
        self.order("await_listener", topic=topic)
        assert self._answers.get(timeout=SECONDS) == {"listened": topic}, self.complaints

    def listen(self, topic: str, kind: str) -> None:
        self._heard[topic] = queue.SimpleQueue()
        self.order("listen", topic=topic, kind=kind)

    def hear(self, topic: str) -> dict[str, Any]:
        """The next message of a topic."""
        return self._heard[topic].get(timeout=SECONDS)

    def heard(self, topic: str) -> bool:
        """Whether a message of a topic waits."""
        return not self._heard[topic].empty()

    def record(self, path: Path) -> None:
        self.order("record", path=str(path))

    def close_bag(self) -> None:
        self.order("close_bag")
        assert self._answers.get(timeout=SECONDS) == {"closed": True}, self.complaints

    def play(self, path: Path, *, poses: str, answers: str) -> None:
        self.order("play", path=str(path), poses=poses, answers=answers)
        assert self._answers.get(timeout=SECONDS) == {"played": True}, self.complaints
