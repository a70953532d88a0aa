"""Handlers of ROS services that answer errors with ``success: false``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge_ros2.messages import Message

ServiceHandler = Callable[["Message"], Mapping[str, Any]]


def wrap_handler(handler: ServiceHandler, log_error: Callable[[str], None]) -> ServiceHandler:
    """Wrap a handler: the wrapper adds ``success`` to the response.

    The wrapper logs a CxbridgeError of the handler, and returns a response with the error's message.
    """

    def respond(request: Message) -> Mapping[str, Any]:
        try:
            return {"success": True, **handler(request)}
        except CxbridgeError as error:
            log_error(str(error))
            return {"success": False, "error": error.message}

    return respond
