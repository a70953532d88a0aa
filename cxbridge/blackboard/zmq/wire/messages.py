"""Conversion of interfaces and messages to and from bodies of frames."""

from __future__ import annotations

from typing import Any
from uuid import UUID

from cxbridge.blackboard.zmq.wire.dataframes import DeliverBody, SendBody
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.schema import InterfaceSchema


def open_body(schema: InterfaceSchema, interface_id: str, owner: str, writer: bool) -> dict[str, Any]:
    """Return the fields of an Open."""
    return {
        "type": schema.name,
        "id": interface_id,
        "hash": schema.hash,
        "size": schema.datasize,
        "owner": owner,
        "writer": writer,
    }


def send_body(sender: Interface, message: Message) -> SendBody:
    """Return the body of a message from a client, without request number."""
    return SendBody(
        request=0,
        instance=sender.serial.bytes,
        source=(message.source_id or sender.serial).bytes,
        type=message.type,
        id=message.id,
        thread=message.sender_thread_name,
        hops=message.hops,
    )


def deliver_body(message: Message) -> DeliverBody:
    """Return the body of a message from the server's process, without delivery number and writer."""
    assert message.sender_id is not None
    assert message.source_id is not None
    return DeliverBody(
        delivery=0,
        instance=b"",
        source=message.source_id.bytes,
        sender=message.sender_id.bytes,
        type=message.type,
        id=message.id,
        thread=message.sender_thread_name,
        hops=message.hops,
    )


def receive_message(
    message_class: type[Message], body: SendBody | DeliverBody, block: bytes, sender: bytes, recipient: int
) -> Message:
    """Return a received message.

    :param sender: the serial of the sending instance.
    :param recipient: the number of the interface in this process.
    :raises InterfaceError: if the size of the block is wrong.
    """
    message = message_class()
    message.set_from_chunk(block)
    serial = UUID(bytes=sender)
    message.address(body.id, recipient, serial, serial if body.source == sender else UUID(bytes=body.source))
    message.mark_foreign(body.hops + 1, body.thread)
    return message
