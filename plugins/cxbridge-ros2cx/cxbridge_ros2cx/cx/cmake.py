"""The files that a ROS package in a source tree would install, according to its CMakeLists.txt.

Commands and variables are found by patterns: neither conditions nor functions of CMake are evaluated.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Final

from msgspec import Struct

# a bracket comment, or a comment to the end of the line
_COMMENT: Final = re.compile(r"#\[\[.*?\]\]|#[^\n]*", re.DOTALL)
# a command, whose arguments may contain one level of parentheses
_COMMAND: Final = re.compile(r"\b(\w+)\s*\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
# a quoted argument, which may contain escaped quotes, or an unquoted argument
_ARGUMENT: Final = re.compile(r'"((?:[^"\\]|\\.)*)"|([^\s"]+)')
_VARIABLE: Final = re.compile(r"\$\{(\w+)\}")
# the kinds of sources that exist without a build
_INSTALL_KINDS: Final = ("DIRECTORY", "FILES", "PROGRAMS")
# keywords that end the list of sources in an install command
_END_KEYWORDS: Final = frozenset(
    {
        *("DESTINATION", "PATTERN", "REGEX", "FILES_MATCHING", "PERMISSIONS", "OPTIONAL", "RENAME"),
        *("USE_SOURCE_PERMISSIONS", "COMPONENT", "EXCLUDE", "TYPE", "CONFIGURATIONS"),
    }
)


class InstalledEntry(Struct, frozen=True):
    """A file or folder that a package installs.

    :param target: the destination of the file, or of the folder's content, relative to the install prefix.
    """

    source: Path
    target: str


class CMakeCommand(Struct, frozen=True):
    """A command of a CMakeLists.txt."""

    name: str
    arguments: tuple[str, ...]


def read_commands(file: Path) -> list[CMakeCommand]:
    """Return the commands of a CMakeLists.txt with expanded variables; empty if the file is unreadable."""
    try:
        text = _COMMENT.sub("", file.read_text("utf-8", "replace"))
    except OSError:
        return []
    variables: dict[str, str] = {"CMAKE_CURRENT_SOURCE_DIR": str(file.parent)}
    variables["CMAKE_SOURCE_DIR"] = variables["PROJECT_SOURCE_DIR"] = str(file.parent)
    commands = []
    for name, argument_text in _COMMAND.findall(text):
        # as in CMake, an undefined variable is empty
        expanded_text = _VARIABLE.sub(lambda match: variables.get(match[1], ""), argument_text)
        arguments = tuple(quoted or unquoted for quoted, unquoted in _ARGUMENT.findall(expanded_text))
        if name.lower() == "project" and arguments:
            variables["PROJECT_NAME"] = arguments[0]
        elif name.lower() == "set" and arguments:
            variables[arguments[0]] = " ".join(arguments[1:])
        commands.append(CMakeCommand(name.lower(), arguments))
    return commands


def find_installed_entries(commands: list[CMakeCommand], folder: Path) -> Iterator[InstalledEntry]:
    """Yield the files and folders of a package's ``install`` commands."""
    for command in commands:
        arguments = command.arguments  # the first argument says the kind of the sources, which follow
        if (
            command.name != "install"
            or "DESTINATION" not in arguments[:-1]
            or arguments[0] not in _INSTALL_KINDS
        ):
            continue
        target = arguments[arguments.index("DESTINATION") + 1].strip("/")
        new_name = arguments[arguments.index("RENAME") + 1] if "RENAME" in arguments[:-1] else ""
        for source_text in takewhile(lambda argument: argument not in _END_KEYWORDS, arguments[1:]):
            source = folder / source_text
            # as in CMake, the slash means the content of the folder
            if arguments[0] == "DIRECTORY" and source_text.endswith("/"):
                yield InstalledEntry(source, target)
            else:
                yield InstalledEntry(source, f"{target}/{new_name or source.name}")
