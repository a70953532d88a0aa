"""Checkouts laid over each other: a team's and Fawkes', each with the same folders below it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from msgspec import Struct

CONFIGURATION: Final = "cfg"
"""The folder of a checkout with its configuration: relative includes are seen from there."""

_BASE: Final = "BASEDIR"


class Checkouts(Struct, frozen=True):
    """Folders with the same layout; a file of an earlier folder hides the same file of a later one.

    :param folders: absolute, the first wins.
    """

    folders: tuple[Path, ...] = ()

    def confdir(self, file: Path) -> Path:
        """Return the folder that relative includes of a configuration file are seen from, as in Fawkes.

        :returns: the folder ``cfg`` of the checkout that has the file; the file's own in no checkout.
        """
        own = file.resolve()
        for folder in self.folders:
            configuration = folder / CONFIGURATION
            if own.is_relative_to(configuration.resolve()):
                return configuration
        return file.parent

    def base(self, file: Path) -> Path:
        """Return the checkout that has a configuration file, or else the last, or else the file's folder."""
        own = file.resolve()
        holders = (folder for folder in self.folders if own.is_relative_to(folder.resolve()))
        return next(holders, self.folders[-1] if self.folders else own.parent)

    def find_configuration(self, name: Path) -> Path:
        """Return the file or folder of that name below the configuration of a checkout; the name if none."""
        found = (folder / CONFIGURATION / name for folder in self.folders)
        return next((path for path in found if path.exists()), name)

    def parts(self, pattern: str) -> list[Path]:
        """Return the folders that match a pattern, of each checkout in its turn."""
        return [path for folder in self.folders for path in sorted(folder.glob(pattern)) if path.is_dir()]

    def expand(self, text: str, placeholders: dict[str, str], here: Path) -> list[Path]:
        """Return the folders that a configured path stands for: one for each checkout that has it.

        :param placeholders: what ``BASEDIR`` and its like stand for; used where no checkout has the folder.
        :param here: the base folder of relative paths.
        """
        paths = [here / substitute_path(text, placeholders)]
        if f"@{_BASE}@" in text:
            bases = (placeholders | {_BASE: str(folder)} for folder in self.folders)
            paths = [path for each in bases if (path := here / substitute_path(text, each)).is_dir()] or paths
        return paths


PLACEHOLDERS = ("BASEDIR", "FAWKES_BASEDIR", "RESDIR", "CONFDIR")
"""The placeholders that the CLIPS Executive registers (without their @), in its order."""


def substitute_path(text: str, folders: Mapping[str, str | Path]) -> str:
    """Return a configured path with its placeholders replaced.

    Each placeholder is replaced once, where it stands first, as Fawkes does. One without a folder stays.

    :param folders: the folder for each placeholder, by its name without @, e.g. ``{"BASEDIR":
        "/opt/fawkes"}``.
    """
    for name, folder in folders.items():
        text = text.replace(f"@{name}@", str(folder), 1)
    return text
