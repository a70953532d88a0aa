"""The settings of the feature ``protobuf``: message definitions and the address of servers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.listening import LOOPBACK

# The key of a `MakeConnections` in `Additions.values`; without the key, connections use sockets.
CONNECTIONS_KEY: Final = "protobuf.connections"

_SETTINGS_PATH: Final = "/clips-protobuf/"


@dataclass(frozen=True, slots=True)
class ProtobufSettings:
    """The configuration below ``/clips-protobuf/``.

    :param folders: the folders with .proto files.
    :param server_address: the address of servers; ``*``: all network interfaces.
    """

    folders: tuple[Path, ...] = ()
    server_address: str = LOOPBACK

    @classmethod
    def from_config(cls, config: Configuration, expand: Callable[[str], Iterable[Path]]) -> ProtobufSettings:
        """Read the settings.

        :param expand: returns the folders for a configured path.
        :raises ConfigError: if a setting has the wrong type.
        """
        folders = config.get_strings(_SETTINGS_PATH + "proto-dirs", default=[])
        return cls(
            tuple(path for folder in folders for path in expand(folder)),
            config.get_str(_SETTINGS_PATH + "server-address", default=LOOPBACK),
        )
