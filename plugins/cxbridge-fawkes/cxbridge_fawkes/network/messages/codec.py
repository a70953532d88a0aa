"""Conversion of frames to messages of the blackboard component, without I/O, and the size limits of messages.

::

    decoder = FrameDecoder(client_payload_limit)
    for frame in decoder.feed(received):
        message = decode(frame)
    sock.sendall(Close(serial).to_bytes())
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame

# chosen freely
UNKNOWN_LIMIT: Final = 64 * 1024
"""The maximum payload, in bytes, of a message of unknown kind to a server's blackboard, and of messages to
components other than blackboard and configuration.
"""
# a text may have 64 KiB, and a list several texts
CONFIG_LIMIT: Final = 256 * 1024
"""The maximum payload, in bytes, of a request of the configuration, which may have a value."""
# the largest messages are lists of interfaces, with 154 bytes for each: enough for 100,000
CLIENT_MESSAGE_LIMIT: Final = 16 * 1024 * 1024
"""The maximum payload, in bytes, of a message to a client."""

_SERIAL_SIZE: Final = 16
_NAMES_SIZE: Final = bb.TYPE_SIZE + bb.ID_SIZE
# the payload sizes of requests to the server, in bytes
_REQUEST_SIZES: Final[Mapping[int, int]] = {
    bb.BoardKind.LIST_ALL: 0,
    bb.BoardKind.LIST: _NAMES_SIZE,
    bb.BoardKind.OPEN_FOR_READING: _NAMES_SIZE + bb.HASH_SIZE,
    bb.BoardKind.OPEN_FOR_WRITING: _NAMES_SIZE + bb.HASH_SIZE,
    bb.BoardKind.CLOSE: _SERIAL_SIZE,
}

# chosen freely
MAX_EXCESS: Final = 1024
"""The number of bytes by which a message to a server may exceed its known size without ending the connection.

The server ignores a message of wrong size and logs a complaint. A still longer message ends the connection.
For messages of other components and kinds, see `CONFIG_LIMIT` and `UNKNOWN_LIMIT`.
"""


def decode(frame: FawkesFrame) -> bb.BlackBoardMessage:
    """Return the message in a frame of the blackboard component.

    :raises MalformedMessageError: if the component is not the blackboard, the kind is unknown, or the bytes
        are invalid.
    """
    if frame.component != ComponentId.BLACKBOARD or frame.kind not in bb.MESSAGES:
        raise MalformedMessageError(
            f"component {frame.component} of the protocol has no messages of kind {frame.kind}"
        )
    message_class, attributes = bb.MESSAGES[frame.kind]
    return message_class.unpack(frame.payload, **attributes)


def server_payload_limit(component: int, kind: int, max_block_size: int) -> int:
    """Return the maximum payload of a message to a server, in bytes.

    :param max_block_size: the size of the largest block that the client may send now.
    """
    if component == ComponentId.BLACKBOARD:
        if kind in _REQUEST_SIZES:
            return _REQUEST_SIZES[kind] + MAX_EXCESS
        if kind in (
            bb.BoardKind.DATA_REFRESHED,
            bb.BoardKind.DATA_CHANGED,
            bb.BoardKind.INTERFACE_MESSAGE,
        ):
            return bb.MESSAGE_HEAD_SIZE + max_block_size + MAX_EXCESS
    return CONFIG_LIMIT if component == ComponentId.CONFIGURATION else UNKNOWN_LIMIT


def client_payload_limit(component: int, kind: int) -> int:  # noqa: ARG001 - the signature of a limit
    """Return the maximum payload of a message to a client, in bytes."""
    return CLIENT_MESSAGE_LIMIT
