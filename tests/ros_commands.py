"""Commands of ROS in the documentation: what they name must be there, and messages must fit. ROS itself need not be."""

import re
from pathlib import Path
from typing import Any

import yaml

from fervor_ros import topics
from fervor_ros.parameters import PARAMETERS
from pages import ROOT

WORKSPACE = ROOT / "clients" / "ros2"
CHECKOUT = "src/fervor/"
"""Where the reader has this repository."""

FIELDS = {
    "hri_msgs/msg/IdsList": {"header", "ids"},
    "hri_msgs/msg/Expression": {"header", "expression", "valence", "arousal", "confidence"},
    "sensor_msgs/msg/JointState": {"header", "name", "position", "velocity", "effort"},
}
"""Of messages that readers write by hand."""


def check_ros(command: list[str], where: str) -> None:
    match command:
        case ["colcon", "build", "--base-paths", path] | ["rosdep", "install", "--from-paths", path, "--ignore-src"]:
            assert (ROOT / path.removeprefix(CHECKOUT)).is_dir(), where
        case ["ros2", "launch", package, file, *arguments]:
            launch = (WORKSPACE / package / "launch" / file).read_text(encoding="utf-8")
            declared = set(re.findall(r'DeclareLaunchArgument\(\s*"(\w+)"', launch))
            assert {argument.partition(":=")[0] for argument in arguments} <= declared, where
        case ["ros2", "run", package, program, "--ros-args", *arguments]:
            assert f'"{program} = ' in (WORKSPACE / package / "setup.py").read_text(encoding="utf-8"), where
            assert arguments[::2] == ["-p"] * (len(arguments) // 2), where
            defaults = {parameter.name: parameter.default for parameter in PARAMETERS}
            for argument in arguments[1::2]:
                name, _, value = argument.partition(":=")
                assert type(yaml.safe_load(value)) is type(defaults[name]), where
        case ["ros2", "topic", "echo", name]:
            assert any(fits(topic, name) for topic in topics.OUT), where
        case ["ros2", "topic", "pub", *_, name, kind, message]:
            assert any(fits(topic, name) and topic.type == kind for topic in topics.IN), where
            fields: dict[str, Any] = yaml.safe_load(message)
            assert fields.keys() <= FIELDS[kind], where
        case _:
            raise AssertionError(f"{where}: not a command that this test knows")


def fits(topic: topics.Topic, name: str) -> bool:
    """Whether it can be the topic's name."""
    return re.fullmatch(topic.of("/humans", r"\w+"), name) is not None


def parameters_of(path: Path) -> dict[str, Any]:
    """What a file of parameters sets for the node."""
    settings: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))["fervor"]["ros__parameters"]
    return settings
