"""Writes the ROS package ``cxbridge_msgs`` with a message for each interface, and the action of Skillers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from string import Template
from typing import Final

from cxbridge import __version__
from cxbridge.file_access import write_file
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS, PACKAGE, generate_definitions
from cxbridge_ros2.names import parse_type

_MANIFEST: Final = Template("""<?xml version="1.0"?>
<package format="3">
  <name>$name</name>
  <version>$version</version>
  <description>Interfaces of the blackboard as messages, and the action of Skillers</description>
  <maintainer email="none@example.org">cxbridge</maintainer>
  <license>GPL-2.0-or-later</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>builtin_interfaces</depend>
  <depend>action_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
""")

_BUILD_FILE: Final = Template("""cmake_minimum_required(VERSION 3.16)
project($name)
find_package(ament_cmake REQUIRED)
find_package(builtin_interfaces REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces($${PROJECT_NAME}
$files
  DEPENDENCIES builtin_interfaces
)
ament_export_dependencies(rosidl_default_runtime)
ament_package()
""")


def write_package(schemas: Iterable[InterfaceSchema], folder: Path) -> Path:
    """Write the package into a folder, such as the ``src`` of a workspace; return the package's folder."""
    definitions = ACTION_DEFINITIONS | generate_definitions(schemas)
    type_names = map(parse_type, definitions)
    texts_by_file = {
        f"{name.kind}/{name.name}.{name.kind}": definition
        for name, definition in zip(type_names, definitions.values(), strict=True)
    }
    file_list = "\n".join(f'  "{file}"' for file in sorted(texts_by_file))
    texts_by_file["CMakeLists.txt"] = _BUILD_FILE.substitute(name=PACKAGE, files=file_list)
    numbers = [number for number in __version__.split(".") if number.isdecimal()]
    version = ".".join((*numbers, "0", "0", "0")[:3])  # ROS requires three numbers
    texts_by_file["package.xml"] = _MANIFEST.substitute(name=PACKAGE, version=version)
    for file, text in texts_by_file.items():
        write_file(folder / PACKAGE / file, text)
    return folder / PACKAGE
