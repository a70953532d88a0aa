"""The settings of the connections of an environment."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NetworkSettings:
    """What the configuration says below ``/clips-protobuf/``.

    :param server_address: where servers listen; ``*``: everywhere.
    :param max_message_size: bytes.
    :param max_outbound: bytes that wait for one connection.
    :param max_waiting: messages that wait for the environment.
    """

    server_address: str = "127.0.0.1"
    frame_version: int = 2
    max_message_size: int = 1 << 20
    max_outbound: int = 8 << 20
    max_waiting: int = 10_000
