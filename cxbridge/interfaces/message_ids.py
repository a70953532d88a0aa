"""Ids that senders assign to their messages.

An instance counts its messages with 16 bits. A writer shows the id of the message it processes, by convention
in the field ``msgid``; readers recognise the results of their messages only by this id. A sender therefore
leaves out two ids:

- 0, which means that no message is processed or was sent;

- the id that the interface already shows. All senders count from 1: the id belongs to an earlier
  message, perhaps of another sender. The sender would take the shown state for the result of its new message.
"""

from __future__ import annotations

import struct
from typing import Final

from cxbridge.interfaces.schema import InterfaceSchema

MESSAGE_ID_MASK: Final = 0xFFFF
"""The mask of 16-bit message ids."""

NO_MESSAGE: Final = 0
"""The id that means no message."""

ID_FIELDS: Final = ("msgid", "msg_id")
"""The fields in which writers show, by convention, the id of the message that they process."""

_U32: Final = struct.Struct("=I")


def next_id(last_id: int, shown_id: int = NO_MESSAGE) -> int:
    """Return the id after ``last_id`` that is neither 0 nor the id that the interface shows.

    :param last_id: the last id of the sender, 0 before its first message.
    :param shown_id: the id that the interface shows, 0 for no message.
    """
    new_id = last_id % MESSAGE_ID_MASK + 1  # 65535 is followed by 1
    return new_id if new_id != shown_id else new_id % MESSAGE_ID_MASK + 1


def id_offset(schema: InterfaceSchema) -> int | None:
    """Return the offset of the message id in a block, or None if no field shows the id."""
    for name in ID_FIELDS:
        field = schema.field(name)
        if field is not None and field.type == "uint32" and field.length is None:
            return field.offset
    return None


def read_id(block: bytes | bytearray, offset: int | None) -> int:
    """Return the message id that a block shows, 0 without such a field.

    :param offset: the result of :func:`id_offset`.
    """
    return NO_MESSAGE if offset is None else int(_U32.unpack_from(block, offset)[0])


def replace_id(block: bytes, offset: int, message_id: int) -> bytes:
    """Return a copy of a block that shows another message id."""
    return block[:offset] + _U32.pack(message_id) + block[offset + _U32.size :]
