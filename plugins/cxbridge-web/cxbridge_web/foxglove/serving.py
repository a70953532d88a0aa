"""Creation of the server for Foxglove, whose package is an optional dependency."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge_web.foxglove.settings import FoxgloveSettings

if TYPE_CHECKING:
    from cxbridge.events import EventBus
    from cxbridge_web.foxglove.live import FoxgloveServer


def make_foxglove_server(bus: EventBus, settings: FoxgloveSettings) -> FoxgloveServer:
    """Return a server that is not started yet.

    :raises CxbridgeError: if it would be public, or its package is missing.
    """
    settings.check()
    try:
        from cxbridge_web.foxglove.live import FoxgloveServer  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise CxbridgeError(
            f"live connections to Foxglove need the package '{error.name}'",
            hint=install_command("foxglove", "cxbridge-web"),
        ) from None
    return FoxgloveServer(bus, settings)
