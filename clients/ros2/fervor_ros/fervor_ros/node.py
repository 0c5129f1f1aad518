"""The node `fervor`: ROS in, ROS out; what becomes of it in between is `Perception`'s and `Uplink`'s.

All of ROS happens in the executor's thread. Estimates come from another one: they wait in a queue, and a guard
condition wakes the executor.
"""

import math
import os
import queue
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time as TimeMessage
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fervor_msgs.msg import Intensity
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.time import Time

from fervor.errors import FervorError
from fervor.protocol.messages import Estimate
from fervor_client import Reconnect, sync
from fervor_client.options import Options
from fervor_client.sync import Session
from fervor_ros import topics
from fervor_ros.health import health
from fervor_ros.parameters import PARAMETERS, Parameter, Settings, settings_of
from fervor_ros.perception import Answer, Frame, Perception
from fervor_ros.pose import Stamp
from fervor_ros.subscriptions import Listeners, message_class, qos
from fervor_ros.topics import Topic
from fervor_ros.transforms import Transform
from fervor_ros.uplink import Uplink

SWEEP_S = 0.2
"""How often it is looked who is gone."""


class FervorNode(Node):
    """Feeds what is perceived of people to a service, and publishes what it tells."""

    def __init__(self, **options: Any) -> None:
        """`options`: see `rclpy.node.Node`.

        Raises:
            InputError: a parameter can't be used.
        """
        super().__init__("fervor", **options)
        for parameter in PARAMETERS:
            self.declare_parameter(parameter.name, parameter.default, _descriptor(parameter))
        self._settings = settings_of({item.name: self.get_parameter(item.name).value for item in PARAMETERS})
        self._perception = Perception(self._settings)
        self._listeners = Listeners(self)
        self._outlets: dict[str, Publisher] = {}
        self._unnamable: set[str] = set()
        self._estimates: queue.SimpleQueue[Estimate] = queue.SimpleQueue()
        self._awake = self.create_guard_condition(self._publish_estimates)
        self._diagnostics = self.create_publisher(DiagnosticArray, topics.DIAGNOSTICS.name, 10)
        self._uplink = Uplink(partial(_open_session, self._settings, os.environ.get("FERVOR_TOKEN")), self._deliver)
        self._listen_to_all()
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still, or never begin
        self.create_timer(SWEEP_S, self._sweep, clock=steady)
        self.create_timer(self._settings.diagnostics_period_s, self._publish_diagnostics, clock=steady)
        self._uplink.start()

    def destroy_node(self) -> None:
        """Part from the service, then from ROS."""
        self._uplink.close()
        super().destroy_node()

    # --- who there is -------------------------------------------------------------------------------------------------

    def _listen_to_all(self) -> None:
        """Listen to the topics that are not one for each human."""
        heard: dict[Topic, Callable[[Any], None]] = {
            topics.BODIES: self._bodies_listed,
            topics.FACES: self._faces_listed,
            topics.PERSONS: self._persons_listed,
        }
        if self._settings.source == "tf":
            heard |= {
                topics.TF: partial(self._transforms, static=False),
                topics.TF_STATIC: partial(self._transforms, static=True),
            }
        for topic, callback in heard.items():
            self._listeners.open(topic, "", topic.of(self._settings.humans), callback)
        self._follow()

    def _bodies_listed(self, message: Any) -> None:
        self._perception.bodies_listed(message.ids, self._now())
        self._follow()

    def _faces_listed(self, message: Any) -> None:
        self._perception.faces_listed(message.ids)
        self._follow()

    def _persons_listed(self, message: Any) -> None:
        self._perception.persons_listed(message.ids)
        self._follow()

    def _matched(self, topic: Topic, person: str, message: Any) -> None:
        self._perception.matched(topic, person, message.data)
        self._follow()

    def _sweep(self) -> None:
        """Part from bodies that are gone."""
        frames, gone = self._perception.sweep(self._now())
        self._send(*frames)
        for body in gone:
            self._uplink.end_body(body)
        self._follow()
        self._listeners.lower()

    def _follow(self) -> None:
        """Listen to, and publish on, the topics of the humans that matter now, and no others."""
        wanted = self._perception.interests
        for body in self._outlets.keys() - {human for topic, human in wanted if topic == topics.INTENSITY}:
            self.destroy_publisher(self._outlets.pop(body))
        for topic, human in set(self._listeners) - wanted:
            if human:
                self._listeners.close(topic, human)
        for topic, human in wanted - set(self._listeners):
            if human in self._unnamable:
                continue
            try:
                self._open(topic, human)
            except InvalidTopicNameException:
                self._unnamable.add(human)
                expected = "expected letters, digits and _, a letter first"
                self.get_logger().warning(f"the id {human!r} makes no name of a topic and is passed over; {expected}")

    def _open(self, topic: Topic, human: str) -> None:
        name = topic.of(self._settings.humans, human)
        if topic != topics.INTENSITY:
            heard = {
                topics.JOINT_STATES: partial(self._joint_states, human),
                topics.JOINT_ROTATIONS: partial(self._joint_rotations, human),
                topics.BODY_OF_PERSON: partial(self._matched, topic, human),
                topics.FACE_OF_PERSON: partial(self._matched, topic, human),
                topics.FACE_EXPRESSION: partial(self._expression, topic, human),
                topics.PERSON_EXPRESSION: partial(self._expression, topic, human),
            }
            self._listeners.open(topic, human, name, heard[topic])
        elif human not in self._outlets:
            self._outlets[human] = self.create_publisher(message_class(topic.type), name, qos(latched=False))

    # --- what they do -------------------------------------------------------------------------------------------------

    def _expression(self, topic: Topic, human: str, message: Any) -> None:
        stamp = self._stamp(message.header.stamp)
        self._perception.expression(topic, human, message.expression, message.confidence, stamp)

    def _joint_states(self, body: str, message: Any) -> None:
        stamp = self._stamp(message.header.stamp)
        self._send(self._perception.joint_states(body, message.name, message.position, stamp))

    def _joint_rotations(self, body: str, message: Any) -> None:
        rotations = [_xyzw(transform.rotation) for transform in message.transforms]
        stamp = self._stamp(message.header.stamp)
        self._send(self._perception.joint_rotations(body, message.joint_names, rotations, stamp))

    def _transforms(self, message: Any, *, static: bool) -> None:
        for told in message.transforms:
            transform = Transform(
                told.child_frame_id.removeprefix("/"),
                told.header.frame_id.removeprefix("/"),
                np.array(_xyzw(told.transform.rotation)),
                self._stamp(told.header.stamp),
            )
            self._send(*self._perception.transform(transform, static=static))

    def _send(self, *frames: Frame) -> None:
        for frame in frames:
            self._uplink.send(frame)

    # --- what comes back ----------------------------------------------------------------------------------------------

    def _deliver(self, estimate: Estimate) -> None:
        """Called from another thread."""
        self._estimates.put(estimate)
        self._awake.trigger()

    def _publish_estimates(self) -> None:
        while not self._estimates.empty():
            answer = self._perception.answered(self._estimates.get())
            publisher = self._outlets.get(answer.estimate.body)
            if publisher is not None:
                publisher.publish(self._intensity(answer))

    def _intensity(self, answer: Answer) -> Intensity:
        estimate, model = answer.estimate, self._uplink.line.model
        message = Intensity()
        message.header.stamp = Time(nanoseconds=answer.stamp).to_msg()
        message.header.frame_id = f"body_{estimate.body}"
        message.body_id, message.person_id = estimate.body, answer.person
        message.emotion = estimate.emotion
        message.intensity = math.nan if estimate.intensity is None else estimate.intensity
        message.level = estimate.level or Intensity.LEVEL_NONE
        message.status, message.flags = estimate.status, list(estimate.flags)
        if model is not None:
            message.model, message.demo = f"{model.name} {model.version}", model.purpose == "demo"
        return message

    def _publish_diagnostics(self) -> None:
        perception = self._perception
        found = health(
            self._uplink.line,
            service=self._settings.service,
            silent=perception.silent() - self._unnamable,
            bodies=len(perception.bodies),
        )
        status = DiagnosticStatus(
            level=bytes([found.severity]),
            name=f"{self.get_name()}: service",
            message=found.message,
            hardware_id=self._settings.service,
            values=[KeyValue(key=key, value=value) for key, value in found.values],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _now(self) -> Stamp:
        return int(self.get_clock().now().nanoseconds)

    def _stamp(self, stamp: TimeMessage) -> Stamp:
        """Of a header; now where it bears none."""
        return Time.from_msg(stamp).nanoseconds or self._now()


def _open_session(
    settings: Settings,
    token: str | None,
    on_error: Callable[[FervorError], None],
    on_reconnect: Callable[[Reconnect], None],
) -> Session:
    options = Options() if settings.axes is None else Options(axes=settings.axes)
    return sync.connect(
        settings.service,
        skeleton=settings.skeleton.name,
        token=token,
        on_error=on_error,
        on_reconnect=on_reconnect,
        retry_for=None,
        **options,
    )


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=parameter.description, read_only=True)
    if parameter.choices:
        descriptor.additional_constraints = "one of " + ", ".join(choice or "''" for choice in parameter.choices)
    if parameter.most is not None:
        descriptor.floating_point_range = [FloatingPointRange(from_value=0.0, to_value=parameter.most)]
    return descriptor


def _xyzw(rotation: Any) -> tuple[float, float, float, float]:
    return rotation.x, rotation.y, rotation.z, rotation.w
