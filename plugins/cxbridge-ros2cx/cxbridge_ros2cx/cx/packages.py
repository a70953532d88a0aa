"""The ROS packages for an agent: the packages of a checkout or workspace, then the packages of a sourced ROS.

The build of a workspace installs packages below prefixes. ament, the build system, lists packages and their
resources in an index below each prefix. A source tree without a build has no index: there CMakeLists.txt
lists the files, and :class:`SourceTree` links them into a folder that looks like a prefix.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Final

from cxbridge.file_access import walk_folders
from cxbridge_ros2cx.cx.cmake import CMakeCommand, find_installed_entries, read_commands

_INDEX: Final = "share/ament_index/resource_index"
_PACKAGE_RESOURCE: Final = "packages"
_PLUGIN_RESOURCE: Final = "cx_plugin__pluginlib__plugin"
# the command that declares a plug-in with linked protobuf messages: its class, then its .proto files
_LINKED_PLUGIN_COMMAND: Final = "cx_generate_linked_protobuf_plugin_from_proto"
# the name in a package.xml; without such a name, the folder of the file is not a package
_PACKAGE_NAME: Final = re.compile(r"<name>\s*([\w-]+)\s*</name>")
# the folders that Python packages usually install; their setup.py, a program, is not executed
_PYTHON_FOLDERS: Final = (
    *("clips", "config", "launch", "params", "pddl", "proto"),
    *("msg", "srv", "action", "resource"),
)
# the output of colcon, which contains copies of the packages, and the packages of npm
_SKIPPED_FOLDERS: Final = frozenset({"build", "install", "log", "node_modules"})
_IGNORE_FILES: Final = ("COLCON_IGNORE", "AMENT_IGNORE")


class InstalledPrefix:
    """A prefix with an ament index."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def find_resources(self, kind: str) -> Mapping[str, str]:
        """Return the contents of a kind's resources by name; the kind ``packages`` lists the packages."""
        contents = {}
        with suppress(OSError):  # an index without resources of this kind has no folder for them
            for file_path in sorted((self.path / _INDEX / kind).iterdir()):
                contents[file_path.name] = file_path.read_text("utf-8", "replace")
        return contents

    def find_share_folder(self, package: str) -> Path:
        return self.path / "share" / package

    def find_file(self, package: str, name: str) -> Path:
        """Return the path of a package's file, e.g. of a message definition."""
        return self.find_share_folder(package) / name

    def find_proto_files(self, class_name: str) -> list[Path]:
        """Return the .proto files of the package whose plug-in description contains a class."""
        for package, description in self.find_resources(_PLUGIN_RESOURCE).items():
            for relative_path in description.split():
                with suppress(OSError):  # a description may name a missing file
                    if f'"{class_name}"' in (self.path / relative_path).read_text("utf-8", "replace"):
                        return sorted(self.find_share_folder(package).rglob("*.proto"))
        return []


class SourceTree:
    """The packages of a source tree; links to their files form a prefix.

    The links to a package's files are made when an agent first needs the package.

    :param root: the folder with the packages.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._linked_packages: set[str] = set()

    @cached_property
    def path(self) -> Path:
        """The prefix: a cache folder of this tree, or a temporary folder if the cache cannot be made."""
        cache_root = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
        # 12 digits are enough to tell the trees of a user apart
        tree_digest = hashlib.sha256(str(self.root).encode("utf-8", "surrogateescape")).hexdigest()[:12]
        path = Path(cache_root).expanduser() / "cxbridge" / "ros2cx" / tree_digest
        with suppress(OSError):
            path.mkdir(parents=True, exist_ok=True)
            return path
        return Path(tempfile.mkdtemp(prefix="cxbridge-ros2cx-"))

    @cached_property
    def packages(self) -> dict[str, Path]:
        return dict(sorted(_find_packages(self.root)))

    @cached_property
    def _commands(self) -> dict[str, list[CMakeCommand]]:
        return {name: read_commands(folder / "CMakeLists.txt") for name, folder in self.packages.items()}

    def find_resources(self, kind: str) -> Mapping[str, str]:
        if kind == _PACKAGE_RESOURCE:
            return dict.fromkeys(self.packages, "")
        contents = {}
        for package, commands in self._commands.items():
            for command in commands:
                # the command ament_vendor registers a resource of this kind, with the folder of the software
                if command.name == "ament_vendor" and kind == "vendor_packages":
                    contents[package] = f"opt/{package}"
                elif command.name == "ament_index_register_resource" and command.arguments[:1] == (kind,):
                    name = _read_option(command, "PACKAGE_NAME") or package
                    contents[name] = _read_option(command, "CONTENT")
        return contents

    def find_share_folder(self, package: str) -> Path:
        """Return the share folder of a package, with links to its installed files."""
        share_folder = self.path / "share" / package
        if package in self.packages and package not in self._linked_packages:
            self._linked_packages.add(package)
            folder = self.packages[package]
            _link(folder / "package.xml", share_folder / "package.xml")
            for entry in find_installed_entries(self._commands[package], folder):
                if entry.target.startswith("share/"):
                    _link(entry.source, self.path / entry.target)
            if (folder / "setup.py").is_file():
                for name in _PYTHON_FOLDERS:
                    _link(folder / name, share_folder / name)
        return share_folder

    def find_file(self, package: str, name: str) -> Path:
        return self.packages.get(package, self.root) / name

    def find_proto_files(self, class_name: str) -> list[Path]:
        """Return the .proto files of a plug-in's class that the CMakeLists.txt of a package declares."""
        name = class_name.removeprefix("cx::")
        return [
            self.packages[package] / file_path
            for package, commands in self._commands.items()
            for command in commands
            if command.name == _LINKED_PLUGIN_COMMAND and command.arguments[:1] == (name,)
            for file_path in command.arguments[1:]
        ]


Prefix = InstalledPrefix | SourceTree


class Packages:
    """The packages of several prefixes; a package hides packages of the same name in later prefixes."""

    def __init__(self, prefixes: Iterable[Prefix]) -> None:
        self.prefixes = tuple(prefixes)

    @classmethod
    def from_folders(
        cls, definition_folders: Iterable[Path], environment_variables: Mapping[str, str] = os.environ
    ) -> Packages:
        """Return the packages in checkouts, workspaces and prefixes, and the packages of a sourced ROS."""
        prefixes: list[Prefix] = []
        for folder in definition_folders:
            installed_prefixes = [
                InstalledPrefix(path) for path in _find_installed_prefixes(folder.resolve())
            ]
            prefixes += installed_prefixes or [SourceTree(folder)]
        sourced_paths = environment_variables.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        prefixes += (InstalledPrefix(Path(path)) for path in sourced_paths if path)
        return cls(prefixes)

    def find_resources(self, kind: str) -> dict[str, tuple[str, Prefix]]:
        """Return contents and prefixes of the resources of a kind, sorted by name."""
        resources: dict[str, tuple[str, Prefix]] = {}
        # reversed: the update with the first prefix comes last, so its resources hide equal names
        for prefix in reversed(self.prefixes):
            resources |= {name: (content, prefix) for name, content in prefix.find_resources(kind).items()}
        return dict(sorted(resources.items()))

    @cached_property
    def prefix_by_package(self) -> dict[str, Prefix]:
        return {name: prefix for name, (_, prefix) in self.find_resources(_PACKAGE_RESOURCE).items()}

    def find_share_folder(self, package: str) -> Path | None:
        """Return the share folder of a package; None if the package does not exist."""
        prefix = self.prefix_by_package.get(package)
        return None if prefix is None else prefix.find_share_folder(package)

    def find_proto_files(self, class_name: str) -> list[Path]:
        """Return the .proto files of a plug-in's class, in the first prefix that has any; may be empty."""
        return next(filter(None, (prefix.find_proto_files(class_name) for prefix in self.prefixes)), [])

    def has_file(self, package: str, name: str) -> bool:
        prefix = self.prefix_by_package.get(package)
        return prefix is not None and prefix.find_file(package, name).is_file()

    @property
    def definition_folders(self) -> list[Path]:
        """The folders with message definitions; earlier folders hide later ones."""
        return [
            folder
            for prefix in self.prefixes
            if (folder := prefix.root if isinstance(prefix, SourceTree) else prefix.path).is_dir()
        ]


def _read_option(command: CMakeCommand, name: str) -> str:
    """Return the argument that follows a keyword; empty without the keyword."""
    arguments = command.arguments
    return arguments[arguments.index(name) + 1] if name in arguments[:-1] else ""


def _find_packages(root: Path) -> Iterator[tuple[str, Path]]:
    """Yield the names and folders of the packages below a folder.

    As in colcon, a file ``COLCON_IGNORE`` or ``AMENT_IGNORE`` excludes a folder, and a package contains no
    other packages.
    """
    for folder, subfolders, files in walk_folders(root):
        if any(name in files for name in _IGNORE_FILES):
            subfolders.clear()
        elif "package.xml" in files:
            subfolders.clear()
            match = _PACKAGE_NAME.search((Path(folder) / "package.xml").read_text("utf-8", "replace"))
            if match:
                yield match[1], Path(folder)
        else:
            subfolders[:] = sorted(
                name for name in subfolders if name[0] != "." and name not in _SKIPPED_FOLDERS
            )


def _find_installed_prefixes(folder: Path) -> list[Path]:
    """Return the prefixes of a workspace or an installation; empty without a build."""
    # colcon installs all packages into the folder install, or each package into a folder below
    candidates = (folder, folder / "install", *sorted((folder / "install").glob("*")))
    return [path for path in candidates if (path / _INDEX).is_dir()]


def _link(source: Path, target: Path) -> None:
    """Link a file, or each file of a folder: several folders may be installed into the same folder."""
    if source.is_dir():
        for item in source.iterdir():
            _link(item, target / item.name)
        return
    if not source.is_file() or (target.is_symlink() and target.readlink() == source):
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    # renamed at the end, which is atomic: a second run may make the same link at the same time
    new_link = target.with_name(f".{target.name}.{os.getpid()}")
    new_link.unlink(missing_ok=True)
    new_link.symlink_to(source)
    new_link.replace(target)


def find_package_folder(file_path: Path) -> Path | None:
    """Return the folder of the package that contains a file; None for a file outside packages."""
    return next(
        (folder for folder in file_path.resolve().parents if (folder / "package.xml").is_file()), None
    )
