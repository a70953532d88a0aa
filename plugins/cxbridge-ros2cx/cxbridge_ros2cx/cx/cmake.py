"""The installed files of a package in a source tree, from its CMakeLists.txt."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Final

from msgspec import Struct

_COMMENT: Final = re.compile(r"#\[\[.*?\]\]|#[^\n]*", re.DOTALL)
# a command, whose arguments may contain one level of parentheses
_COMMAND: Final = re.compile(r"\b(\w+)\s*\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
_WORD: Final = re.compile(r'"((?:[^"\\]|\\.)*)"|([^\s"]+)')
_VARIABLE: Final = re.compile(r"\$\{(\w+)\}")
_INSTALL_KINDS: Final = ("DIRECTORY", "FILES", "PROGRAMS")
# keywords after which a command names no more sources
_END_KEYWORDS: Final = frozenset(
    {
        *("DESTINATION", "PATTERN", "REGEX", "FILES_MATCHING", "PERMISSIONS", "OPTIONAL", "RENAME"),
        *("USE_SOURCE_PERMISSIONS", "COMPONENT", "EXCLUDE", "TYPE", "CONFIGURATIONS"),
    }
)


class Installed(Struct, frozen=True):
    """A file or folder that a package installs.

    :param target: the destination of the file or folder, relative to the prefix.
    """

    source: Path
    target: str


class Command(Struct, frozen=True):
    """A command of a CMakeLists.txt."""

    name: str
    words: tuple[str, ...]


def read_commands(file: Path) -> list[Command]:
    """Return the commands of a CMakeLists.txt with expanded variables; empty if the file is unreadable."""
    try:
        text = _COMMENT.sub("", file.read_text("utf-8", "replace"))
    except OSError:
        return []
    variables: dict[str, str] = {"CMAKE_CURRENT_SOURCE_DIR": str(file.parent)}
    variables["CMAKE_SOURCE_DIR"] = variables["PROJECT_SOURCE_DIR"] = str(file.parent)
    commands = []
    for name, arguments in _COMMAND.findall(text):
        # as in CMake, an undefined variable is empty
        expanded = _VARIABLE.sub(lambda match: variables.get(match[1], ""), arguments)
        words = tuple(quoted or plain for quoted, plain in _WORD.findall(expanded))
        if name.lower() == "project" and words:
            variables["PROJECT_NAME"] = words[0]
        elif name.lower() == "set" and words:
            variables[words[0]] = " ".join(words[1:])
        commands.append(Command(name.lower(), words))
    return commands


def find_installed(commands: list[Command], folder: Path) -> Iterator[Installed]:
    """Yield the files and folders of a package's ``install`` commands."""
    for command in commands:
        words = command.words
        if command.name != "install" or "DESTINATION" not in words or words[0] not in _INSTALL_KINDS:
            continue
        target = words[words.index("DESTINATION") + 1].strip("/")
        renamed = words[words.index("RENAME") + 1] if "RENAME" in words else ""
        for word in takewhile(lambda word: word not in _END_KEYWORDS, words[1:]):
            source = folder / word
            # as in CMake, the slash means the content of the folder
            if words[0] == "DIRECTORY" and word.endswith("/"):
                yield Installed(source, target)
            else:
                yield Installed(source, f"{target}/{renamed or source.name}")
