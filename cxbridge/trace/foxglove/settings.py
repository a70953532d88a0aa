"""Where Foxglove is served, and the server that is made only when somebody wants it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge.events import EventBus
    from cxbridge.trace.foxglove.live import FoxgloveServer

DEFAULT_PORT: Final = 8765
"""Where Foxglove looks for a server when nobody says otherwise."""


@dataclass(frozen=True, slots=True)
class FoxgloveSettings:
    """Where to serve.

    :param port: 0: any free one.
    """

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT


def make_foxglove_server(bus: EventBus, settings: FoxgloveSettings) -> FoxgloveServer:
    """Make a server, which has not started yet.

    :raises CxbridgeError: when the package it needs is not installed.
    """
    try:
        from cxbridge.trace.foxglove.live import FoxgloveServer  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise CxbridgeError(
            f"live connections to Foxglove need the package '{error.name}'",
            hint="pip install 'cxbridge[foxglove]'",
        ) from None
    return FoxgloveServer(bus, settings)
