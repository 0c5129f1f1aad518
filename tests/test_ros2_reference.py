"""docs/how-to/ros2.md and the files of the ROS packages say what the code says, and each other."""

import ast
import json
import re
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from fervor.levels import Level
from fervor.protocol.messages import Status
from fervor_ros import topics
from fervor_ros.expressions import EXPRESSIONS
from fervor_ros.parameters import PARAMETERS, settings_of
from pages import section, table
from ros_commands import WORKSPACE, parameters_of
from test_docs_reference import compare

PAGE = "how-to/ros2.md"
PACKAGE = WORKSPACE / "fervor_ros"
MESSAGE = WORKSPACE / "fervor_msgs" / "msg" / "Intensity.msg"

AT_HOME = {"fervor", "fervor_client", "fervor_ros", "numpy"}
"""What comes with fervor from PyPI."""


def test_every_topic() -> None:
    known = [("in", topic) for topic in topics.IN] + [("out", topic) for topic in topics.OUT]
    expected = [[way, f"`{topic.of('/humans', '<id>')}`", f"`{topic.type}`", topic.use] for way, topic in known]
    compare(table(section(PAGE, "## What it hears and says")), expected, "topics")


def test_every_field_of_the_message() -> None:
    lines = [line.split() for line in MESSAGE.read_text(encoding="utf-8").splitlines() if re.match(r"\S+ \w+$", line)]
    text = section(PAGE, "## What it hears and says")
    compare(table(text[text.index("| field |") :]), [[f"`{name}`", f"`{kind}`"] for kind, name in lines], "Intensity")


def test_constants_of_the_message_are_what_the_service_says() -> None:
    constants = dict(re.findall(r'^string (\w+)="(\w*)"$', MESSAGE.read_text(encoding="utf-8"), re.MULTILINE))
    levels = {value for name, value in constants.items() if name.startswith("LEVEL_")}
    assert levels == {"", *Level}
    assert {value for name, value in constants.items() if name.startswith("STATUS_")} == set(Status.__args__)


def test_every_expression() -> None:
    expected = [[f"`{name}`", f"`{emotion}`"] for name, emotion in EXPRESSIONS.items()]
    compare(table(section(PAGE, "## The emotion")), expected, "expressions")


def test_every_parameter() -> None:
    def shown(value: object) -> str:
        return value or '""' if isinstance(value, str) else json.dumps(value)

    expected = [[f"`{item.name}`", f"`{shown(item.default)}`", item.description] for item in PARAMETERS]
    compare(table(section(PAGE, "## Parameters")), expected, "parameters")


def test_the_packaged_file_has_the_defaults() -> None:
    settings = parameters_of(PACKAGE / "config" / "fervor.yaml")
    assert settings == {item.name: item.default for item in PARAMETERS}
    settings_of(settings)


def test_the_launch_file_starts_what_the_package_installs() -> None:
    tree = ast.parse((PACKAGE / "launch" / "fervor.launch.py").read_text(encoding="utf-8"))
    words = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    assert {"fervor_ros", "fervor_node", "fervor", "fervor.yaml"} <= words
    assert '"fervor_node = fervor_ros.main:main"' in (PACKAGE / "setup.py").read_text(encoding="utf-8")


@pytest.mark.parametrize("package", ["fervor_ros", "fervor_msgs"])
def test_manifests_are_complete(package: str) -> None:
    manifest = ET.parse(WORKSPACE / package / "package.xml").getroot()
    needs = {element.text for element in manifest if element.tag.endswith("depend")}
    used = (
        {topic.type.split("/")[0] for topic in (*topics.IN, *topics.OUT)} if package == "fervor_ros" else {"std_msgs"}
    )
    for source in (WORKSPACE / package).rglob("*.py"):
        used |= imported(source) - AT_HOME if source.name != "setup.py" else set()
    assert used <= needs
    assert manifest.findtext("name") == package
    assert manifest.findtext("license") == "Apache-2.0"


def imported(source: Path) -> set[str]:
    """Packages that a file imports, less those that come with Python."""
    found = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
    return found - sys.stdlib_module_names
