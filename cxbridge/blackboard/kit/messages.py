"""Messages that a transport has received, as objects of the interface's message class."""

from __future__ import annotations

from uuid import UUID

from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.message import UNKNOWN_THREAD


def receive_message(
    instance: Interface,
    message_type: str,
    block: bytes,
    *,
    message_id: int,
    sender: UUID,
    source: UUID,
    hops: int,
    thread: str = UNKNOWN_THREAD,
) -> Message:
    """Return a received message.

    :param instance: an instance of the receiving interface.
    :param sender: the serial of the last sender.
    :param source: the serial of the first sender.
    :param hops: the number of crossed networks.
    :raises UnknownMessageTypeError: if the interface has no such message.
    :raises InterfaceError: if the size of the block is wrong.
    """
    message = instance.create_message(message_type)
    message.set_from_chunk(block)
    message.address(message_id, instance.mem_serial, sender, source)
    message.mark_foreign(hops, thread)
    return message
