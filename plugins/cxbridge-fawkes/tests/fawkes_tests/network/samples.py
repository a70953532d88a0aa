"""A message of each form, and its JSON form."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any
from uuid import UUID

from cxbridge.events import Level
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import configuration as config
from cxbridge_fawkes.network.messages.fields import WireValue
from cxbridge_fawkes.network.messages.logger import LogMessage

ONE, TWO = UUID(int=0x0102030405060708090A0B0C0D0E0F10), UUID(int=2)
HASH = bytes(range(16))

SAMPLES: dict[str, WireValue] = {
    "bb-list-all": bb.ListAll(),
    "bb-list": bb.ListMatching("Test*", "[ab]?"),
    "bb-interface-list": bb.InterfaceList(
        (
            bb.ListedInterface("TestInterface", "a", HASH, 7, True, 3, 1_500_000_000_250_000),
            bb.ListedInterface("OtherInterface", "", HASH, 8, False, 0, 0),
        )
    ),
    "bb-interface-list-empty": bb.InterfaceList(()),
    "bb-open-for-reading": bb.Open("TestInterface", "a", HASH, writing=False),
    "bb-open-for-writing": bb.Open("T" * 48, "i" * 64, HASH, writing=True),
    "bb-open-success": bb.OpenSuccess(ONE, True, 2, b"\x01\x02\x03\x04"),
    "bb-open-failure": bb.OpenFailure(bb.OpenError.WRITER_EXISTS),
    "bb-close": bb.Close(ONE),
    "bb-interface-message": bb.WireMessage(ONE, TWO, "SetMessage", 65535, 1, b"\x2a\0\0\0"),
    "bb-data-refreshed": bb.DataMessage(ONE, b"\x05\x06", changed=False),
    "bb-data-changed": bb.DataMessage(ONE, b"", changed=True),
    "bb-reader-added": bb.InstanceEvent(bb.BoardKind.READER_ADDED, ONE, TWO),
    "bb-writer-removed": bb.InstanceEvent(bb.BoardKind.WRITER_REMOVED, ONE, TWO),
    "bb-interface-created": bb.InterfaceEvent(bb.BoardKind.INTERFACE_CREATED, "TestInterface", "a"),
    "bb-interface-destroyed": bb.InterfaceEvent(bb.BoardKind.INTERFACE_DESTROYED, "TestInterface", "ä"),
    "config-bool-value": config.ConfigMessage(config.ConfigKind.BOOL_VALUE, "/a/b", (True,)),
    "config-float-values": config.ConfigMessage(
        config.ConfigKind.FLOAT_VALUE, "/a", (0.5, -2.0), is_list=True
    ),
    "config-string-value": config.ConfigMessage(config.ConfigKind.STRING_VALUE, "/a/b", ("test",)),
    "config-inv-value": config.ConfigMessage(config.ConfigKind.INV_VALUE, "/a/b"),
    "log-message": LogMessage(1_500_000_000_250_000, Level.WARN, "Skiller", "late"),
}


def to_json(value: Any) -> Any:
    """Return the JSON form of a message, with hexadecimal bytes and with serials and kinds as text."""
    if is_dataclass(value):
        values = {field.name: to_json(getattr(value, field.name)) for field in fields(value)}
        return {"message": type(value).__name__} | values
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, UUID):
        return str(value)
    return [to_json(item) for item in value] if isinstance(value, tuple) else value
