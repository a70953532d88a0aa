"""The ROS packages for an agent: those of a checkout or workspace, then those of a sourced ROS.

A built workspace has an ament index below each prefix. Source trees have none: CMakeLists.txt lists the
installed files, and :class:`SourceTree` links them into a separate folder.
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

from cxbridge.file_access import walk
from cxbridge_ros2cx.cx.cmake import Command, find_installed, read_commands

_INDEX: Final = "share/ament_index/resource_index"
_PACKAGES: Final = "packages"
_PLUGIN_RESOURCE: Final = "cx_plugin__pluginlib__plugin"
_LINKED: Final = "cx_generate_linked_protobuf_plugin_from_proto"
# package.xml is searched, not parsed: a folder with a broken one is no package
_NAME: Final = re.compile(r"<name>\s*([\w-]+)\s*</name>")
# the folders that Python packages usually install: setup.py is not executed to find the true ones
_PYTHON_FOLDERS: Final = (
    *("clips", "config", "launch", "params", "pddl", "proto"),
    *("msg", "srv", "action", "resource"),
)
# output of colcon, which has copies of the packages, and the packages of npm
_NOT_SEARCHED: Final = frozenset({"build", "install", "log", "node_modules"})
_IGNORED: Final = ("COLCON_IGNORE", "AMENT_IGNORE")


class InstalledPrefix:
    """A prefix with an ament index."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def resources(self, kind: str) -> Mapping[str, str]:
        """Return the resources of a kind by name; the kind ``packages`` lists the packages."""
        contents = {}
        with suppress(OSError):  # an index without resources of this kind has no folder for them
            for file in sorted((self.path / _INDEX / kind).iterdir()):
                contents[file.name] = file.read_text("utf-8", "replace")
        return contents

    def share(self, package: str) -> Path:
        return self.path / "share" / package

    def file(self, package: str, name: str) -> Path:
        """Return the path of a package's file, e.g. of a message definition."""
        return self.share(package) / name

    def linked_protos(self, class_name: str) -> list[Path]:
        """Return the .proto files of the package whose plug-in description contains a class."""
        for package, description in self.resources(_PLUGIN_RESOURCE).items():
            share = self.share(package)
            files = (self.path / line for line in description.split())
            if any(f'"{class_name}"' in _read_text(file) for file in files):
                return sorted(share.rglob("*.proto"))
        return []


class SourceTree:
    """The packages of a source tree, linked into a prefix when an agent asks for their files.

    :param root: the folder with the packages.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._linked: set[str] = set()

    @cached_property
    def path(self) -> Path:
        """The prefix: a cache folder per tree, or a temporary folder without a writable cache."""
        base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
        name = hashlib.sha256(str(self.root).encode("utf-8", "surrogateescape")).hexdigest()[:12]
        path = Path(base).expanduser() / "cxbridge" / "ros2cx" / name
        with suppress(OSError):
            path.mkdir(parents=True, exist_ok=True)
            return path
        return Path(tempfile.mkdtemp(prefix="cxbridge-ros2cx-"))

    @cached_property
    def packages(self) -> dict[str, Path]:
        return dict(sorted(_find_packages(self.root)))

    @cached_property
    def _commands(self) -> dict[str, list[Command]]:
        return {name: read_commands(folder / "CMakeLists.txt") for name, folder in self.packages.items()}

    def resources(self, kind: str) -> Mapping[str, str]:
        if kind == _PACKAGES:
            return dict.fromkeys(self.packages, "")
        contents = {}
        for package, commands in self._commands.items():
            for command in commands:
                if command.name == "ament_vendor" and kind == "vendor_packages":
                    contents[package] = f"opt/{package}"
                elif command.name == "ament_index_register_resource" and command.words[:1] == (kind,):
                    name = _option(command, "PACKAGE_NAME") or package
                    contents[name] = _option(command, "CONTENT")
        return contents

    def share(self, package: str) -> Path:
        """Return the share folder of a package, with links to its installed files."""
        share = self.path / "share" / package
        if package in self.packages and package not in self._linked:
            self._linked.add(package)
            folder = self.packages[package]
            _link(folder / "package.xml", share / "package.xml")
            for entry in find_installed(self._commands[package], folder):
                if entry.target.startswith("share/"):
                    _link(entry.source, self.path / entry.target)
            if (folder / "setup.py").is_file():
                for name in _PYTHON_FOLDERS:
                    _link(folder / name, share / name)
        return share

    def file(self, package: str, name: str) -> Path:
        return self.packages.get(package, self.root) / name

    def linked_protos(self, class_name: str) -> list[Path]:
        """Return the .proto files of the plug-in that a package's CMakeLists.txt declares."""
        name = class_name.removeprefix("cx::")
        return [
            self.packages[package] / file
            for package, commands in self._commands.items()
            for command in commands
            if command.name == _LINKED and command.words[:1] == (name,)
            for file in command.words[1:]
        ]


Prefix = InstalledPrefix | SourceTree


class Packages:
    """The packages of several prefixes; a package in an earlier prefix hides equal ones in later prefixes."""

    def __init__(self, prefixes: Iterable[Prefix]) -> None:
        self.prefixes = tuple(prefixes)

    @classmethod
    def of(cls, folders: Iterable[Path], environment: Mapping[str, str] = os.environ) -> Packages:
        """Return the packages in checkouts, workspaces and prefixes, and those of a sourced ROS."""
        prefixes: list[Prefix] = []
        for folder in folders:
            installed_prefixes = [InstalledPrefix(path) for path in _installed_prefixes(folder.resolve())]
            prefixes += installed_prefixes or [SourceTree(folder)]
        sourced = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        prefixes += (InstalledPrefix(Path(path)) for path in sourced if path)
        return cls(prefixes)

    def resources(self, kind: str) -> dict[str, tuple[str, Prefix]]:
        """Return contents and prefixes of the resources of a kind, sorted by name."""
        resources: dict[str, tuple[str, Prefix]] = {}
        # reversed: the first prefix is applied last and hides equal names
        for prefix in reversed(self.prefixes):
            resources.update({name: (text, prefix) for name, text in prefix.resources(kind).items()})
        return dict(sorted(resources.items()))

    @cached_property
    def prefix_of(self) -> dict[str, Prefix]:
        return {name: prefix for name, (_, prefix) in self.resources(_PACKAGES).items()}

    def share(self, package: str) -> Path | None:
        """Return the share folder of a package; None if the package does not exist."""
        prefix = self.prefix_of.get(package)
        return None if prefix is None else prefix.share(package)

    def linked_protos(self, class_name: str) -> list[Path]:
        protos = (prefix.linked_protos(class_name) for prefix in self.prefixes)
        return next(filter(None, protos), [])

    def has_file(self, package: str, name: str) -> bool:
        prefix = self.prefix_of.get(package)
        return prefix is not None and prefix.file(package, name).is_file()

    @property
    def folders(self) -> list[Path]:
        """The folders with message definitions; earlier folders hide later ones."""
        trees = (prefix.root if isinstance(prefix, SourceTree) else prefix.path for prefix in self.prefixes)
        return [folder for folder in trees if folder.is_dir()]


def _read_text(file: Path) -> str:
    try:
        return file.read_text("utf-8", "replace")
    except OSError:
        return ""


def _option(command: Command, name: str) -> str:
    words = command.words
    return words[words.index(name) + 1] if name in words[:-1] else ""


def _find_packages(root: Path) -> Iterator[tuple[str, Path]]:
    """Yield names and folders of the packages below a folder."""
    for folder, below, files in walk(root):
        if any(name in files for name in _IGNORED):
            below.clear()
        elif "package.xml" in files:
            below.clear()
            match = _NAME.search((Path(folder) / "package.xml").read_text("utf-8", "replace"))
            if match:
                yield match[1], Path(folder)
        else:
            below[:] = sorted(name for name in below if name[0] != "." and name not in _NOT_SEARCHED)


def _installed_prefixes(folder: Path) -> list[Path]:
    """Return the prefixes of a workspace or an installation; empty without a build."""
    candidates = (folder, folder / "install", *sorted((folder / "install").glob("*")))
    return [path for path in candidates if (path / _INDEX).is_dir()]


def _link(source: Path, target: Path) -> None:
    """Link a file, or each file of a folder, since several folders may be installed into one."""
    if source.is_dir():
        for item in source.iterdir():
            _link(item, target / item.name)
        return
    if not source.is_file() or (target.is_symlink() and target.readlink() == source):
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    # linked under another name, then renamed: another run may make the same link
    new_link = target.with_name(f".{target.name}.{os.getpid()}")
    new_link.unlink(missing_ok=True)
    new_link.symlink_to(source)
    new_link.replace(target)


def package_folder(file: Path) -> Path | None:
    return next((folder for folder in file.resolve().parents if (folder / "package.xml").is_file()), None)
