"""What transports do with instances and messages that nobody else does."""

# ruff: noqa: SLF001 - a transport stands in for instances of another process

from __future__ import annotations

from typing import Any, cast
from uuid import UUID

from cxbridge.blackboard.memory import InterfaceMemory
from cxbridge.interfaces.instance import Interface, Message, MessageQueue


def memory_of(instance: Interface) -> InterfaceMemory:
    """Return the memory of an instance that is open on a local blackboard."""
    return cast("InterfaceMemory", instance._port)


def replace_queue(instance: Interface, queue: MessageQueue) -> None:
    """Let what comes for a writer go somewhere else."""
    instance._queue = queue


def publish(instance: Interface, block: bytes, stamped: bool | None, changed: bool) -> None:
    """Publish a block that was written in another process."""
    instance.set_from_chunk(block)
    instance._port.publish(instance, instance._buf, stamped, changed)


def receive(message_class: type[Message], body: Any, block: bytes, sender: bytes, recipient: int) -> Message:
    """Return a message as it came over the wire.

    :param body: Send or Deliver of the protocol.
    :param sender: serial of the instance that sent it.
    :param recipient: number of the interface here.
    :raises InterfaceError: when the block is not of the message's size.
    """
    message = message_class()
    message.set_from_chunk(block)
    serial = UUID(bytes=sender)
    message.address(body.id, recipient, serial, serial if body.source == sender else UUID(bytes=body.source))
    message.mark_foreign(body.hops + 1)
    message._sender_thread_name = body.thread
    return message
