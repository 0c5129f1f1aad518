"""What stands around the ROS node in its tests: topics, /clock and bags, told by lines of JSON on standard input.

Run by the Python of the ROS environment; `stages.py` speaks to it. Messages are told as nested dictionaries, and go to
the wire, or into a bag while one is recorded. What is heard on topics is printed.
"""

import contextlib
import importlib
import json
import queue
import sys
import threading
from pathlib import Path
from typing import Any

import rclpy
from rclpy.clock import Clock
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

AHEAD = 16
"""Poses of a bag that may be unanswered: less than any queue on the way holds."""

SECONDS = 60.0
"""Longest wait for anything."""


def message_class(name: str) -> Any:
    package, _, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


def filled(kind: Any, fields: dict[str, Any]) -> Any:
    """A message from a dictionary."""
    message = kind()
    types = kind.get_fields_and_field_types()
    for name, value in fields.items():
        inner = types[name].removeprefix("sequence<").removesuffix(">")
        if "/" in inner:
            part = message_class(inner.replace("/", "/msg/"))
            given = [filled(part, item) for item in value] if isinstance(value, list) else filled(part, value)
            setattr(message, name, given)
        else:
            setattr(message, name, value)
    return message


def told(message: Any) -> Any:
    """A message as a dictionary."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: told(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, bytes):
        return list(message)
    if isinstance(message, (str, bool, int, float)):
        return message
    return [told(item) for item in message]


class Stage:
    """A node that does as it is told, line by line."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("stage", start_parameter_services=False)
        self.publishers: dict[str, Any] = {}
        self.types: dict[str, str] = {}
        self.heard: dict[str, queue.SimpleQueue[None]] = {}
        self.bag: Writer | None = None
        self.lines: dict[str, Any] = {}
        self.count = 0

    def advertise(self, topic: str, kind: str, latched: bool = False, best_effort: bool = False) -> None:
        profile = QoSProfile(
            depth=1000,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
            reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        )
        self.types[topic] = kind
        self.publishers[topic] = self.node.create_publisher(message_class(kind), topic, profile)

    def await_listener(self, topic: str) -> None:
        """Until the node listens, which may have to find its way to a lower quality first."""
        clock = Clock()
        for _ in range(int(SECONDS / 0.02)):
            if self.publishers[topic].get_subscription_count():
                tell(listened=topic)
                return
            clock.sleep_for(rclpy.duration.Duration(seconds=0.02))
        raise TimeoutError(f"nobody listens to {topic}")

    def publish(self, topic: str, fields: dict[str, Any]) -> None:
        message = filled(message_class(self.types[topic]), fields)
        if self.bag is None:
            self.publishers[topic].publish(message)
            return
        if topic not in self.lines:
            self.lines[topic] = self.bag.add_connection(topic, self.types[topic], typestore=definitions())
        self.count += 1
        self.bag.write(self.lines[topic], self.count, serialize_message(message))

    def listen(self, topic: str, kind: str) -> None:
        self.heard[topic] = queue.SimpleQueue()

        def hear(message: Any) -> None:
            tell(topic=topic, message=told(message))
            self.heard[topic].put(None)

        self.node.create_subscription(message_class(kind), topic, hear, 1000)

    def record(self, path: str) -> None:
        self.bag = Writer(Path(path), version=9, storage_plugin=StoragePlugin.SQLITE3)
        self.bag.open()

    def close_bag(self) -> None:
        assert self.bag is not None
        self.bag.close()
        self.bag = None
        tell(closed=True)

    def play(self, path: str, poses: str, answers: str) -> None:
        """Publish a bag's messages as they are; poses never more than `AHEAD` before their answers."""
        ahead = 0
        with Reader(Path(path)) as bag:
            for line, _, payload in bag.messages():
                if line.topic == poses:
                    while ahead >= AHEAD or not self.heard[answers].empty():
                        self.heard[answers].get(timeout=SECONDS)
                        ahead -= 1
                    ahead += 1
                self.publishers[line.topic].publish(bytes(payload))
        tell(played=True)


def definitions() -> Any:
    """What rosbags knows of Jazzy, with the messages that this workspace built."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for package in ("hri_msgs", "fervor_msgs"):
        for prefix in sys.argv[1:]:
            for file in Path(prefix, "share", package, "msg").glob("*.msg"):
                store.register(get_types_from_msg(file.read_text(encoding="utf-8"), f"{package}/msg/{file.stem}"))
    return store


def tell(**what: Any) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def main() -> None:
    rclpy.init()
    stage = Stage()
    spinner = threading.Thread(target=spin, args=(stage.node,))
    spinner.start()
    tell(up=True)
    for line in sys.stdin:
        order, arguments = json.loads(line)
        getattr(stage, order)(**arguments)
    rclpy.try_shutdown()
    spinner.join()


def spin(node: Any) -> None:
    with contextlib.suppress(ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
