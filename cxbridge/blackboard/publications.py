"""Functions that emit writes and messages of interfaces on the event bus.

The values of a block are read only if a listener of the bus takes them, because most writes have none.
docs/formats.md#events describes the outcomes of messages.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.events import BlockWrite, EventBus, InterfaceMessage, InterfaceWrite
from cxbridge.interfaces.message import Message

# the outcomes of messages
HANDLED = "handled"
QUEUED = "queued"
REFUSED = "refused"
SENT = "sent"


def emit_write(
    bus: EventBus,
    time_us: int,
    uid: str,
    hash_: bytes,
    block: bytes | bytearray,
    values: Callable[[], dict[str, Any]],
) -> None:
    """Emit the events of a write for which the bus has listeners.

    :param hash_: the hash of the type's definition, 16 bytes, by which Fawkes tells versions apart.
    :param values: returns the values of the block.
    """
    # most recorders need the values; recorders of bblogger files need the bytes
    if bus.wants(InterfaceWrite):
        bus.emit(InterfaceWrite(time_us, uid, values()))
    if bus.wants(BlockWrite):
        bus.emit(BlockWrite(time_us, uid, hash_, bytes(block)))


def emit_message(
    bus: EventBus | None, time_us: int, uid: str, sender: str, message: Message, outcome: str = ""
) -> None:
    """Emit the outcome of a message if the bus has a listener for messages.

    :param uid: the interface that receives the message.
    :param sender: the owner of the sending instance.
    :param outcome: by default ``queued`` or ``handled``, depending on whether the message is in a queue.
    """
    if bus is not None and bus.wants(InterfaceMessage):
        outcome = outcome or (QUEUED if message.enqueued else HANDLED)
        values = message.as_dict()
        bus.emit(InterfaceMessage(time_us, uid, message.type, message.id, sender, outcome, values))
