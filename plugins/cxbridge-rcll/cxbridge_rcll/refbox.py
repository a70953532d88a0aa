"""A checkout of the referee box of the league, with its rules, configuration and message definitions."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError

RULES_FOLDER: Final = "src/games/rcll"
CONFIGURATION_FOLDER: Final = "cfg"
MESSAGES_FOLDER: Final = "src/msgs/rcll-protobuf-msgs"


class Refbox(Struct, frozen=True):
    """A checkout of the referee box; its files are used unchanged.

    :param folder: the top folder of the checkout.
    """

    folder: Path

    @classmethod
    def open(cls, folder: Path) -> Refbox:
        """Return the checkout.

        :raises CxbridgeError: if the folder has no rules.
        """
        if not (folder / RULES_FOLDER / "init.clp").is_file():
            raise CxbridgeError(
                f"this is not a checkout of the referee box: it has no {RULES_FOLDER}/init.clp",
                file=folder,
                hint="name the top folder of a clone of rcll-refbox",
            )
        return cls(folder.resolve())

    @property
    def rules_folder(self) -> Path:
        """The folder with the CLIPS files."""
        return self.folder / RULES_FOLDER

    @property
    def message_folder(self) -> Path:
        """The folder with message definitions; empty in a clone without submodules."""
        return self.folder / MESSAGES_FOLDER

    def load_configuration(self, *overlays: Path) -> Configuration:
        """Read the configuration as the referee box does: the default file of each folder.

        The folders are read in the order of their names.

        :param overlays: files that are laid over the default configuration.
        """
        config = Configuration()
        for folder in sorted((self.folder / CONFIGURATION_FOLDER).iterdir()):
            default_file = folder / f"default_{folder.name}.yaml"
            if default_file.is_file():
                config.overlay(Configuration.load(default_file, confdir=self.folder / CONFIGURATION_FOLDER))
        config.overlay_files(overlays)
        return config


def find_message_folder(*folders: Path) -> Path:
    """Return the first folder with message definitions.

    :raises CxbridgeError: if no folder has message definitions.
    """
    for folder in folders:
        if any(folder.glob("*.proto")):
            return folder
    names = ", ".join(map(str, folders))
    raise CxbridgeError(
        f"none of these folders has message definitions (*.proto): {names}",
        hint="fetch the submodules of a checkout, or name a clone of rcll-protobuf-msgs with --proto-dir",
    )
