"""Emits writes of interfaces, and messages to their writers, on the event bus.

docs/formats.md#events lists the outcomes of messages.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.events import BlockWrite, EventBus, InterfaceMessage, InterfaceWrite
from cxbridge.interfaces.message import Message

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
    """Emit a write, in the forms that listeners take.

    :param hash_: version of the type.
    :param values: returns the block's values.
    """
    if bus.wants(InterfaceWrite):
        bus.emit(InterfaceWrite(time_us, uid, values()))
    if bus.wants(BlockWrite):
        bus.emit(BlockWrite(time_us, uid, hash_, bytes(block)))


def emit_message(
    bus: EventBus | None, time_us: int, uid: str, sender: str, message: Message, outcome: str = ""
) -> None:
    """Emit the fate of a message, if a listener takes it.

    :param bus: None: there is no bus.
    :param uid: of the interface that it was sent to.
    :param sender: owner of the instance that sent it.
    :param outcome: empty: it was not refused, and itself knows whether it came into a queue.
    """
    if bus is not None and bus.wants(InterfaceMessage):
        outcome = outcome or (QUEUED if message.enqueued else HANDLED)
        values = message.as_dict()
        bus.emit(InterfaceMessage(time_us, uid, message.type, message.id, sender, outcome, values))
