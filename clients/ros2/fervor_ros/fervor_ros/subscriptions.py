"""Subscriptions that come and go with the people, and take what publishers offer.

A subscription asks for the best: reliable, and the last message of a latched topic. A publisher that offers less is
never matched by DDS; so where rclpy tells of one, the subscription is made anew and asks for less.
"""

import importlib
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from fervor_ros.topics import Topic

DEPTH = 64
"""Messages that may wait: two seconds of a 30 Hz sensor."""


def message_class(type_name: str) -> Any:
    """The class of a message type such as `std_msgs/msg/String`."""
    package, _, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def qos(*, latched: bool) -> QoSProfile:
    """The best there is for a topic."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE, durability=durability)


class Listener:
    """One topic, however its publishers offer it."""

    def __init__(self, node: Node, topic: Topic, name: str, callback: Callable[[Any], None]) -> None:
        """Raises:
        rclpy.exceptions.InvalidTopicNameException: no topic can be called so.
        """  # noqa: D205
        self._node = node
        self._type = message_class(topic.type)
        self._name = name
        self._callback = callback
        self._qos = qos(latched=topic.latched)
        self._lowered = False
        self._subscription = self._subscribe()

    def close(self) -> None:
        """Listen no more."""
        self._node.destroy_subscription(self._subscription)

    def lower(self) -> None:
        """Ask for less, if a publisher was found that offers less."""
        if self._lowered:
            self._lowered = False
            self.close()
            self._subscription = self._subscribe()

    def _subscribe(self) -> Subscription:
        events = SubscriptionEventCallbacks(incompatible_qos=self._incompatible)
        return self._node.create_subscription(self._type, self._name, self._callback, self._qos, event_callbacks=events)

    def _incompatible(self, info: QoSRequestedIncompatibleQoSInfo) -> None:
        """A publisher offers less; the subscription can't be destroyed inside its own callback."""
        if info.last_policy_kind == QoSPolicyKind.DURABILITY:
            self._qos.durability = DurabilityPolicy.VOLATILE
        elif info.last_policy_kind == QoSPolicyKind.RELIABILITY:
            self._qos.reliability = ReliabilityPolicy.BEST_EFFORT
        else:
            return
        self._lowered = True


class Listeners:
    """All of them, by topic and human."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._listeners: dict[tuple[Topic, str], Listener] = {}

    def __iter__(self) -> Iterator[tuple[Topic, str]]:
        return iter(tuple(self._listeners))

    def open(self, topic: Topic, human: str, name: str, callback: Callable[[Any], None]) -> None:
        """Listen to a topic. Raises as `Listener` does."""
        self._listeners[topic, human] = Listener(self._node, topic, name, callback)

    def close(self, topic: Topic, human: str) -> None:
        """Listen to it no more."""
        self._listeners.pop((topic, human)).close()

    def lower(self) -> None:
        """Ask for less where a publisher offers less."""
        for listener in self._listeners.values():
            listener.lower()
