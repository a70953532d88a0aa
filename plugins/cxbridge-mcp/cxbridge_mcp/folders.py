"""The files that an assistant may name: scenarios and recordings in the folders of ``cxbridge mcp``."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.resources import shipped_scenarios
from cxbridge.trace.formats.registry import open_run

MAX_SEARCHED_FILES: Final = 20_000  # a search of more files would block the server

_SCENARIO: Final = "scenario.yaml"


class Folders:
    """The folders with scenarios and recordings.

    :param folders: at least one folder.
    :raises CxbridgeError: if a folder does not exist.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        self.folders = [folder.resolve() for folder in folders]
        for folder in self.folders:
            if not folder.is_dir():
                raise CxbridgeError(
                    "there is no such folder", file=folder, hint="name a folder with scenarios or recordings"
                )

    @property
    def home(self) -> Path:
        """The folder for relative paths."""
        return self.folders[0]

    def resolve_path(self, name: str) -> Path:
        """Return the path that an assistant names.

        :raises CxbridgeError: if the path, with its links resolved, is outside the folders.
        """
        # a link may lead out of the folders, so it is resolved before the check
        path = (self.home / name).resolve()
        if not any(path.is_relative_to(folder) for folder in self.folders):
            raise CxbridgeError(
                f"{name} is outside the folders of this server",
                hint=f"the folders are {', '.join(map(str, self.folders))}; see 'cxbridge mcp --help'",
            )
        return path

    def recording_path(self, name: str) -> Path:
        """Return the path of a recording.

        :raises CxbridgeError: if the file does not exist, or the path is outside the folders.
        """
        path = self.resolve_path(name)
        if not path.exists():
            raise CxbridgeError(
                f"there is no recording '{name}'", hint="list_recordings lists all recordings"
            )
        return path

    def new_recording_path(self, name: str) -> Path:
        """Return the path of a recording to create.

        :raises CxbridgeError: if the name does not end in ``.mcap``, the file exists, or the path is outside
            the folders.
        """
        path = self.resolve_path(name)
        if path.suffix != ".mcap":
            raise CxbridgeError(
                f"'{name}' is not a name of a recording", hint="choose a name that ends in .mcap"
            )
        if path.exists():
            raise CxbridgeError(f"'{name}' exists already", hint="choose another name")
        return path

    def scenario_argument(self, name: str) -> str:
        """Return a SCENARIO argument for commands: the name of a shipped scenario, or a path.

        :raises CxbridgeError: if the scenario does not exist, or the path is outside the folders.
        """
        if name in shipped_scenarios():
            return name
        path = self.resolve_path(name)
        if not path.exists():
            raise CxbridgeError(f"there is no scenario '{name}'", hint="list_scenarios lists all scenarios")
        return str(path)

    def list_scenarios(self) -> list[str]:
        """Return the names of the shipped scenarios, then the paths of the scenarios in the folders."""
        scenario_files = (path for path in self._find_files() if path.name == _SCENARIO)
        return [*shipped_scenarios(), *sorted(self._shorten_path(path.parent) for path in scenario_files)]

    def list_recordings(self) -> list[dict[str, Any]]:
        """Return path, format and size of each recording in the folders, newest first."""
        rows = []
        for path in self._find_files():
            try:
                run, stat = open_run(path), path.stat()
            except (CxbridgeError, OSError):
                continue  # not a recording, or removed in the meantime
            # the time of the last change is first, for the order
            rows.append((stat.st_mtime, self._shorten_path(path), run.format, stat.st_size))
        return [
            {"path": path, "format": format_name, "bytes": size}
            for _, path, format_name, size in sorted(rows, reverse=True)
        ]

    def _shorten_path(self, path: Path) -> str:
        """Return the name by which the assistant refers to a path."""
        return str(path.relative_to(self.home)) if path.is_relative_to(self.home) else str(path)

    def _find_files(self) -> Iterator[Path]:
        """Yield the first `MAX_SEARCHED_FILES` regular files, without hidden files and links."""
        return islice(self._walk_files(), MAX_SEARCHED_FILES)

    def _walk_files(self) -> Iterator[Path]:
        for top in dict.fromkeys(self.folders):
            for folder, subfolders, names in os.walk(top):
                # os.walk descends into the remaining folders only
                subfolders[:] = sorted(name for name in subfolders if not name.startswith("."))
                paths = (Path(folder, name) for name in sorted(names) if not name.startswith("."))
                yield from (path for path in paths if path.is_file() and not path.is_symlink())
