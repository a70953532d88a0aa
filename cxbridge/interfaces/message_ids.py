"""The numbers that senders give to their messages.

An instance counts its messages with 16 bits. A writer shows, by convention in the field ``msgid``, which
message it works on; readers have nothing else to tell its answers apart by. So two numbers are left out:

- 0: writers use it for "no message in work", callers for "no message sent";
- the id that the interface shows already: it belongs to an earlier message, perhaps of another sender, as
  all senders count from 1. The caller would take the shown state for the answer to its new message.
"""

from __future__ import annotations

import struct
from typing import Final

from cxbridge.interfaces.schema import InterfaceSchema

MESSAGE_ID_MASK: Final = 0xFFFF
"""Message ids have 16 bits."""

NO_MESSAGE: Final = 0
"""The id of no message."""

ID_FIELDS: Final = ("msgid", "msg_id")
"""The fields by which writers show, by convention, which message they work on."""

_U32: Final = struct.Struct("=I")


def next_id(last: int, shown: int = NO_MESSAGE) -> int:
    """Return the id after ``last`` that is neither 0 nor the one that the interface shows.

    :param last: the id that the sender gave last; 0: none.
    :param shown: the id that the interface shows now; 0: none.
    """
    number = last % MESSAGE_ID_MASK + 1
    return number if number != shown else number % MESSAGE_ID_MASK + 1


def id_offset(schema: InterfaceSchema) -> int | None:
    """Return where in a block the id of a message stands, None when the interface has no such field."""
    for name in ID_FIELDS:
        field = schema.field(name)
        if field is not None and field.type == "uint32" and field.length is None:
            return field.offset
    return None


def id_in(block: bytes | bytearray, offset: int | None) -> int:
    """Return the id of a message that a block shows, 0 when it has no field for it.

    :param offset: see :func:`id_offset`.
    """
    if offset is None:
        return NO_MESSAGE
    number: int = _U32.unpack_from(block, offset)[0]
    return number


def with_id(block: bytes, offset: int, number: int) -> bytes:
    """Return a block that shows another id."""
    return block[:offset] + _U32.pack(number) + block[offset + _U32.size :]
