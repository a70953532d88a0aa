"""The settings of the feature protobuf: message definitions and connections."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cxbridge.config import Configuration

# The key in `Additions.values` for a custom `MakeConnections`; the default is sockets.
CONNECTIONS: Final = "protobuf.connections"

_PREFIX: Final = "/clips-protobuf/"


@dataclass(frozen=True, slots=True)
class NetworkSettings:
    """The connection settings below ``/clips-protobuf/``.

    :param server_address: the address of servers; ``*`` for all interfaces.
    :param max_message_size: bytes.
    :param max_outbound: bytes that may wait for one connection.
    :param max_waiting: messages that may wait for the environment.
    """

    server_address: str = "127.0.0.1"
    frame_version: int = 2
    max_message_size: int = 1 << 20
    max_outbound: int = 8 << 20
    max_waiting: int = 10_000


@dataclass(frozen=True, slots=True)
class ProtobufSettings:
    """The configuration below ``/clips-protobuf/``.

    :param folders: folders with .proto files.
    :param modules: compiled Python modules.
    """

    folders: tuple[Path, ...] = ()
    modules: tuple[str, ...] = ()
    network: NetworkSettings = NetworkSettings()

    @classmethod
    def from_config(cls, config: Configuration, expand: Callable[[str], Iterable[Path]]) -> ProtobufSettings:
        """Read the settings.

        :param expand: returns the folders for a configured path.
        """
        folders = config.get_strings(_PREFIX + "proto-dirs", default=[])
        network: dict[str, Any] = {
            key.replace("-", "_"): config.get_uint(_PREFIX + key)
            for key in ("frame-version", "max-message-size", "max-outbound", "max-waiting")
            if config.exists(_PREFIX + key)
        }
        if config.exists(_PREFIX + "server-address"):
            network["server_address"] = config.get_str(_PREFIX + "server-address")
        if network.get("frame_version", 2) not in (1, 2):
            raise config.error(_PREFIX + "frame-version", "there are frames of version 1 and 2 only")
        return cls(
            tuple(path for folder in folders for path in expand(folder)),
            tuple(config.get_strings(_PREFIX + "modules", default=[])),
            NetworkSettings(**network),
        )
