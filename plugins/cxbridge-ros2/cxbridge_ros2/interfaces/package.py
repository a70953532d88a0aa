"""Writes two ROS packages for machines with ROS: one with definitions, and one that starts this program.

``cxbridge_msgs`` has a message for each interface, and the action of Skillers. ``cxbridge`` starts the
installed program: ``ros2 run cxbridge cxbridge ...``, ``ros2 launch cxbridge daemon.launch.py``.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from string import Template
from typing import Final

from cxbridge import __version__
from cxbridge.file_access import write_file
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.spawning import python_command
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS, PACKAGE, generate_definitions

_MANIFEST: Final = Template("""<?xml version="1.0"?>
<package format="3">
  <name>$name</name>
  <version>$version</version>
  <description>$description</description>
  <maintainer email="none@example.org">cxbridge</maintainer>
  <license>GPL-2.0-or-later</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
$depends
  <export><build_type>ament_cmake</build_type></export>
</package>
""")

_MESSAGE_DEPENDENCIES: Final = """  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>builtin_interfaces</depend>
  <depend>action_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>"""

_PROGRAM_DEPENDENCIES: Final = """  <exec_depend>ros2launch</exec_depend>"""

_BUILD_MESSAGES: Final = Template("""cmake_minimum_required(VERSION 3.16)
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

_BUILD_PROGRAM: Final = """cmake_minimum_required(VERSION 3.16)
project(cxbridge NONE)
find_package(ament_cmake REQUIRED)
install(PROGRAMS cxbridge DESTINATION lib/cxbridge)
install(DIRECTORY launch DESTINATION share/cxbridge)
ament_package()
"""

_LAUNCH: Final = '''"""Start a daemon of cxbridge; the argument config names its configuration."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Return the daemon; the launch ends with it."""
    program = ["ros2", "run", "cxbridge", "cxbridge", "daemon", LaunchConfiguration("config")]
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", description="the daemon's configuration, a YAML file"),
            ExecuteProcess(cmd=program, output="screen", on_exit=Shutdown()),
        ]
    )
'''


def write_packages(schemas: Iterable[InterfaceSchema], folder: Path) -> list[Path]:
    """Write both packages into a folder, such as the ``src`` of a workspace; return the packages' folders."""
    texts = dict(ACTION_DEFINITIONS)
    for schema in schemas:
        texts.update(generate_definitions(schema))
    files = {PACKAGE: _make_message_files(texts), "cxbridge": _make_program_files()}
    for package, contents in files.items():
        for name, text in contents.items():
            write_file(folder / package / name, text)
    (folder / "cxbridge/cxbridge").chmod(0o755)  # `ros2 run` starts executable files only
    return [folder / package for package in files]


def _make_message_files(texts: Mapping[str, str]) -> dict[str, str]:
    files = {}
    for type_name, text in texts.items():
        _, folder, name = type_name.split("/")
        files[f"{folder}/{name}.{folder}"] = text
    file_list = "\n".join(f'  "{file}"' for file in sorted(files))
    manifest = _format_manifest(
        PACKAGE, "Interfaces of the blackboard as messages, and the action of Skillers", _MESSAGE_DEPENDENCIES
    )
    build_file = _BUILD_MESSAGES.substitute(name=PACKAGE, files=file_list)
    return {**files, "package.xml": manifest, "CMakeLists.txt": build_file}


def _make_program_files() -> dict[str, str]:
    # a script with the path of this Python, since the Python of ROS does not have cxbridge
    start_script = f'#!/bin/sh\nexec {shlex.join(python_command("-m", "cxbridge"))} "$@"\n'
    return {
        "package.xml": _format_manifest(
            "cxbridge", "The CLIPS Executive as a program", _PROGRAM_DEPENDENCIES
        ),
        "CMakeLists.txt": _BUILD_PROGRAM,
        "cxbridge": start_script,
        "launch/daemon.launch.py": _LAUNCH,
    }


def _format_manifest(name: str, description: str, depends: str) -> str:
    numbers = [number for number in __version__.split(".") if number.isdecimal()]
    version = ".".join((*numbers, "0", "0", "0")[:3])  # ROS requires three numbers
    return _MANIFEST.substitute(name=name, version=version, description=description, depends=depends)
