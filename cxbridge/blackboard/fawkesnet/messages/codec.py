"""Conversion of frames to typed values and back, for all components, without I/O.

::


    decoder = FrameDecoder(client_limit(largest_block))
    for frame in decoder.feed(received):
        message = decode(frame)
    sock.sendall(Close(serial).to_bytes())
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages import blackboard as bb
from cxbridge.blackboard.fawkesnet.messages import configuration as config
from cxbridge.blackboard.fawkesnet.messages import logger as log
from cxbridge.blackboard.fawkesnet.messages import plugins as plugin
from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame

Message = (
    bb.BlackBoardMessage
    | config.ConfigMessage
    | config.ConfigList
    | log.LogSubscription
    | log.LogMessage
    | plugin.PluginMessage
)

UNKNOWN_LIMIT: Final = 64 * 1024
"""The maximum size of a message of unknown kind."""
CONFIG_LIMIT: Final = 256 * 1024
"""The maximum size of a message that sets a configuration value."""
LIST_LIMIT: Final = 16 * 1024 * 1024
"""The maximum size of a list or other message from a server."""

_NAMES: Final = bb.TYPE_SIZE + bb.ID_SIZE
# The payload of requests to the server, in bytes.
_TO_SERVER: Final[Mapping[int, int]] = {
    bb.BoardKind.LIST_ALL: 0,
    bb.BoardKind.LIST: _NAMES,
    bb.BoardKind.OPEN_FOR_READING: _NAMES + 16,
    bb.BoardKind.OPEN_FOR_WRITING: _NAMES + 16,
    bb.BoardKind.CLOSE: 16,
}
# A message may exceed its limit by these bytes: the server then refuses the message but keeps the connection.
_SLACK: Final = 1024

ALWAYS_ALLOWED: Final = _SLACK
"""The size permitted for every message to a server."""


def decode(frame: FawkesFrame) -> Message:
    """Return the message in a frame.

    :raises MalformedMessageError: if component or kind are unknown, or the bytes are invalid.
    """
    match frame.component:
        case ComponentId.BLACKBOARD:
            return bb.unpack_blackboard(frame.kind, frame.payload)
        case ComponentId.CONFIGURATION:
            return config.unpack_config(frame.kind, frame.payload)
        case ComponentId.NETWORK_LOGGER:
            return log.unpack_log(frame.kind, frame.payload)
        case ComponentId.PLUGIN_MANAGER:
            return plugin.PluginMessage.unpack(frame.kind, frame.payload)
    raise MalformedMessageError(f"there is no component {frame.component}")


def limit_to_server(component: int, kind: int, largest_block: int) -> int:
    """Return the maximum payload of a message to a server.

    :param largest_block: the size of the largest block that the client may send now.
    """
    if component == ComponentId.BLACKBOARD:
        fixed = _TO_SERVER.get(kind)
        if fixed is not None:
            return int(fixed) + _SLACK
        if kind in (
            bb.BoardKind.DATA_REFRESHED,
            bb.BoardKind.DATA_CHANGED,
            bb.BoardKind.INTERFACE_MESSAGE,
        ):
            return bb.MESSAGE_HEAD_SIZE + largest_block + _SLACK
    if component == ComponentId.CONFIGURATION:
        return CONFIG_LIMIT
    return UNKNOWN_LIMIT


def limit_to_client(component: int, kind: int) -> int:  # noqa: ARG001 - the signature of a limit
    """Return the maximum payload of a message to a client."""
    return LIST_LIMIT
