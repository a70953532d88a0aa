"""Instances and messages with a test port, without a blackboard."""

from __future__ import annotations

import sys
from typing import Any
from uuid import UUID

import pytest

from cxbridge.interfaces import instance_errors
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.instance import Interface, Message, Port
from cxbridge.interfaces.layout import make_field, place_fields
from cxbridge.interfaces.message_ids import next_id
from cxbridge.interfaces.schema import InterfaceSchema, MessageSchema
from cxbridge.interfaces.shared import SharedBlock

SERIAL = UUID(int=7)


def make_class() -> Any:
    fields, size = place_fields([make_field("count", "uint32")])
    message_fields, message_size = place_fields([make_field("count", "uint32")])
    messages = (MessageSchema("SetCountMessage", message_size, message_fields),)
    return make_interface_class(InterfaceSchema("CountInterface", bytes(16), size, fields, messages))


CountInterface: Any = make_class()


class CountingPort:
    """A port that records its calls."""

    mem_serial = 3

    def __init__(self) -> None:
        self.version = 0
        self.data = bytearray(CountInterface.SCHEMA.datasize)
        self.fetches = 0
        self.published: list[tuple[bool | None, bool]] = []
        self.sent: list[Message] = []
        self.time_us = 1_500_000

    def now_us(self) -> int:
        return self.time_us

    def fetch(self, target: bytearray) -> tuple[int, int, int]:
        self.fetches += 1
        target[:] = self.data
        return self.version, self.version, self.version

    def publish(
        self, writer: SharedBlock, block: bytes | bytearray, stamped: bool | None, changed: bool
    ) -> int:
        self.published.append((stamped, changed))
        self.data[:] = block
        self.version += 1
        return self.version

    def next_id(self, last_id: int) -> int:
        return next_id(last_id)

    def next_id_is_stale(self, last_id: int) -> bool:
        return False

    def transmit(self, sender: Interface, message: Message) -> None:
        self.sent.append(message)

    def writer_owner(self) -> str:
        return "w"

    def has_writer(self) -> bool:
        return True

    def reader_owner(self, serial: str) -> str:
        return ""

    def reader_owners(self) -> tuple[str, ...]:
        return ("r",)

    def close(self, instance: Interface) -> None:
        instance.invalidate()


@pytest.fixture
def port() -> CountingPort:
    return CountingPort()


def open_on(port: Port[Interface], *, writer: bool = False) -> Any:
    return CountInterface(port, id="a", owner="me", serial=SERIAL, writer=writer)


def test_read_copies_new_data_only(port):
    reader = open_on(port)
    reader.read()
    assert port.fetches == 1
    for _ in range(3):
        assert reader.read() is False
    assert port.fetches == 1
    open_on(port, writer=True).write()
    reader.read()
    reader.read()
    assert port.fetches == 2


def test_writer_does_not_fetch_own_write(port):
    writer = open_on(port, writer=True)
    writer.count = 5
    writer.write()
    assert writer.read() is False
    assert port.fetches == 0


def test_flags_of_write_are_those_since_previous_write(port):
    writer = open_on(port, writer=True)
    writer.write()
    writer.count = 1
    writer.write()
    writer.count = 1
    writer.write()
    writer.mark_data_changed()
    writer.write()
    assert port.published == [(None, False), (True, True), (True, False), (False, True)]


def test_closed_instance_refuses_calls_but_has_names(port):
    writer = open_on(port, writer=True)
    reader = open_on(port)
    writer.close()
    reader.close()
    assert (writer.valid, writer.uid, writer.serial) == (False, "CountInterface::a", SERIAL)
    for call, name in [
        (reader.read, "read()"),
        (writer.write, "write()"),
        (lambda: reader.msgq_enqueue(CountInterface.SetCountMessage()), "msgq_enqueue()"),
        (lambda: reader.has_writer, "has_writer()"),
        (lambda: reader.num_readers, "readers()"),
        (lambda: reader.writer, "writer()"),
    ]:
        with pytest.raises(instance_errors.InvalidInstanceError) as caught:
            call()
        assert caught.value.message == (
            f"The interface CountInterface::a (instance serial {SERIAL}) is invalid. "
            f"You cannot call {name} anymore."
        )
    writer.count = 1
    with pytest.raises(instance_errors.InvalidInstanceError, match=r"call write\(\) anymore"):
        writer.write()


def test_closed_instance_is_freed_without_garbage_collector(port):
    instance = open_on(port)
    count = sys.getrefcount(instance)
    instance.close()
    assert sys.getrefcount(instance) == count
