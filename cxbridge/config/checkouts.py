"""Layered checkouts of a team and of Fawkes, which have the same folder structure.

A team builds its robot on Fawkes: its checkout has the files that differ, and Fawkes' has the rest. Paths in
configurations begin with placeholders such as ``@BASEDIR@``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from msgspec import Struct

CONFIGURATION: Final = "cfg"
"""The configuration folder of a checkout, the base of relative includes."""

_BASE: Final = "BASEDIR"


class Checkouts(Struct, frozen=True):
    """Checkouts with the same layout; a file of an earlier checkout hides the file of a later checkout.

    :param folders: absolute paths, by decreasing precedence.
    """

    folders: tuple[Path, ...] = ()

    def confdir(self, file: Path) -> Path:
        """Return the base folder of relative includes of a configuration file, as in Fawkes.

        :returns: the folder ``cfg`` that contains the file; for a file elsewhere, the file's folder.
        """
        resolved = file.resolve()
        for folder in self.folders:
            configuration_folder = folder / CONFIGURATION
            if resolved.is_relative_to(configuration_folder.resolve()):
                return configuration_folder
        return file.parent

    def find_checkout(self, file: Path) -> Path:
        """Return the checkout of a configuration file, else the last checkout, else the file's folder."""
        resolved = file.resolve()
        checkouts = (folder for folder in self.folders if resolved.is_relative_to(folder.resolve()))
        # the last checkout is Fawkes', which has the files that a team does not replace
        return next(checkouts, self.folders[-1] if self.folders else resolved.parent)

    def find_configuration(self, name: Path) -> Path:
        """Return the file or folder of a name in the first folder ``cfg`` with it, else the name itself."""
        paths = (folder / CONFIGURATION / name for folder in self.folders)
        return next((path for path in paths if path.exists()), name)

    def find_matching_folders(self, pattern: str) -> list[Path]:
        """Return the folders that match a pattern: those of the first checkout, sorted, then of the next."""
        return [path for folder in self.folders for path in sorted(folder.glob(pattern)) if path.is_dir()]

    def expand(self, configured_path: str, placeholders: dict[str, str], base: Path) -> list[Path]:
        """Return the folders of a configured path, one for each checkout that has the folder.

        A path without ``@BASEDIR@``, or to a folder that no checkout has, gives one path that may not exist.

        :param configured_path: a path that may begin with a placeholder, e.g. ``@BASEDIR@/src/clips``.
        :param placeholders: the values of ``BASEDIR`` etc.; that of ``BASEDIR`` is used only if no checkout
            has the folder.
        :param base: the base of relative paths.
        """
        default = base / substitute_path(configured_path, placeholders)
        if f"@{_BASE}@" not in configured_path:  # the path does not depend on the checkout
            return [default]
        bases = (placeholders | {_BASE: str(folder)} for folder in self.folders)
        paths = [base / substitute_path(configured_path, values) for values in bases]
        return [path for path in paths if path.is_dir()] or [default]


PLACEHOLDERS = ("BASEDIR", "FAWKES_BASEDIR", "RESDIR", "CONFDIR")
"""The placeholders that the CLIPS Executive registers, without their @, in its order."""


def substitute_path(configured_path: str, folders: Mapping[str, str | Path]) -> str:
    """Return a configured path with placeholders replaced.

    As in Fawkes, only the first occurrence of each placeholder is replaced.

    :param folders: folders by placeholder without @, e.g. ``{"BASEDIR": "/opt/fawkes"}``.
    """
    for name, folder in folders.items():
        configured_path = configured_path.replace(f"@{name}@", str(folder), 1)
    return configured_path
