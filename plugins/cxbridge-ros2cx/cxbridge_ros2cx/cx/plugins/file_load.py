"""The plug-in ``cx::FileLoadPlugin``: loads the CLIPS files of an environment."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import Symbol
from cxbridge.run.source import LoadedFile
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_FILE_LIST_PARAMETERS = ("load", "batch", "cleanup_batch")


class FileLoadPlugin(CxPlugin):
    """Loads files into a new environment, then executes batch files, and clean-up files at the end."""

    def initialize(self) -> None:
        """Find the files, by absolute paths or in the share folders of packages; log the missing files."""
        self._files: dict[str, list[Path]] = {parameter_name: [] for parameter_name in _FILE_LIST_PARAMETERS}
        folders = self.find_share_folders()
        for parameter_name, paths in self._files.items():
            for file in self.parameters.get_strings(self.parameter(parameter_name)):
                # If `file` is absolute, `folder / file` is `file`. Without a folder, the only candidate is an
                # absolute `file`: the product of the list and False is empty.
                candidates = [folder / file for folder in folders] or [Path(file)] * Path(file).is_absolute()
                path = next((path for path in candidates if path.is_file()), None)
                if path is None:
                    self.log_parameter_error(
                        parameter_name,
                        f"names a file that does not exist: {file}",
                        f"searched: {', '.join(map(str, folders)) or 'no folder'}",
                    )
                else:
                    paths.append(path.resolve())

    def init_context(self, env: ClipsEnvironment) -> None:
        """Load the files, then execute the batch files.

        :raises ClipsError: if a file does not load, or a batch file cannot be read.
        """
        self.log.info(f"Initializing plugin for environment {env.name}")
        if self.context.is_inspection:  # the caller loads the files
            return
        for parameter_name, execute in (("load", env.load), ("batch", env.batch)):
            for file in self._files[parameter_name]:
                # each file starts in MAIN since pull request 33: the file before may have changed the module
                if self.context.has_2026_changes:
                    env.call("set-current-module", Symbol("MAIN"))
                if not execute(file):
                    # the text of the ROS 2 CX
                    raise ClipsError(f"Failed to load file '{file}' failed!, aborting...")

    def loaded_files(self) -> list[LoadedFile]:
        """Return the files that are loaded or executed, including the clean-up files."""
        loaded_files = []
        for parameter_name, files in self._files.items():
            mark = self.parameters.find_mark(self.parameter(parameter_name))
            loaded_files += [LoadedFile(file, parameter_name != "load", mark) for file in files]
        return loaded_files

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Execute the clean-up files."""
        for file in () if self.context.is_inspection else self._files["cleanup_batch"]:
            env.batch(file)
