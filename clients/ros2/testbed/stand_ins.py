"""Writes the message packages that are on no index: `python stand_ins.py FOLDER`.

`tf2_msgs` from the definition that rosbags has. `hri_msgs` in words of our own: the two messages that the node hears,
with the fields of the official ones in their order, so that both are the same on the wire.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

from rosbags.typesys import Stores, get_typestore

IDS_LIST = """\
std_msgs/Header header
string[] ids
"""
EXPRESSION = """\
std_msgs/Header header
string expression
float32 valence
float32 arousal
float32 confidence
"""

MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>A stand-in for tests.</description>
  <maintainer email="fervor@example.org">fervor developers</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>{needs}</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package({needs} REQUIRED)
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} DEPENDENCIES {needs})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


def write_package(folder: Path, name: str, needs: str, messages: Mapping[str, str]) -> None:
    """Write a package of messages that rests on one other."""
    (folder / name / "msg").mkdir(parents=True, exist_ok=True)
    for message, definition in messages.items():
        (folder / name / "msg" / f"{message}.msg").write_text(definition, encoding="utf-8")
    files = " ".join(f'"msg/{message}.msg"' for message in messages)
    (folder / name / "package.xml").write_text(MANIFEST.format(name=name, needs=needs), encoding="utf-8")
    (folder / name / "CMakeLists.txt").write_text(CMAKE.format(name=name, needs=needs, files=files), encoding="utf-8")


def transforms() -> str:
    """The definition of `tf2_msgs/msg/TFMessage`."""
    known, _ = get_typestore(Stores.ROS2_JAZZY).generate_msgdef("tf2_msgs/msg/TFMessage", ros_version=2)
    return known.split("=" * 80)[0]  # the types that it rests on follow


if __name__ == "__main__":
    target = Path(sys.argv[1])
    write_package(target, "hri_msgs", "std_msgs", {"IdsList": IDS_LIST, "Expression": EXPRESSION})
    write_package(target, "tf2_msgs", "geometry_msgs", {"TFMessage": transforms()})
