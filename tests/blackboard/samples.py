"""Two small interface types for the tests of blackboards, and a registry of them."""

from __future__ import annotations

import hashlib
from typing import Any

from msgspec.structs import replace

from cxbridge.errors import InterfaceError
from cxbridge.interfaces import SkillerInterface
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.layout import make_field, place_fields
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema, MessageSchema


def _message(name: str, *fields: FieldSchema) -> MessageSchema:
    placed, size = place_fields(fields)
    return MessageSchema(f"{name}Message", size, placed)


def _interface(name: str, fields: list[FieldSchema], messages: list[MessageSchema]) -> InterfaceSchema:
    placed, size = place_fields(fields)
    digest = hashlib.md5(name.encode()).digest()
    return InterfaceSchema(name, digest, size, placed, tuple(messages))


SAMPLE_SCHEMA = _interface(
    "SampleInterface",
    [
        make_field("count", "uint32"),
        make_field("text", "string", 32),
        make_field("numbers", "uint32", 64),
    ],
    [
        _message("SetCount", make_field("count", "uint32")),
        _message("Add", make_field("summand", "int32"), make_field("addend", "int32")),
        _message("Reset"),
    ],
)
OTHER_SCHEMA = _interface(
    "OtherInterface",
    [make_field("enabled", "bool")],
    [_message("SetCount", make_field("count", "uint32"))],
)
SampleInterface: Any = make_interface_class(SAMPLE_SCHEMA)
"""Fields count, text, numbers[64]; messages SetCount(count), Add(summand, addend), Reset()."""

OtherInterface: Any = make_interface_class(OTHER_SCHEMA)
"""Field enabled; a message with the name and layout of a message of SampleInterface."""

NewerSampleInterface: Any = make_interface_class(replace(SAMPLE_SCHEMA, hash=bytes(16)))
"""SampleInterface with another hash."""


def remade_sample_interface() -> Any:
    """Return another class with the definition of SampleInterface, as of another registry."""
    return make_interface_class.__wrapped__(SAMPLE_SCHEMA)


class SampleRegistry:
    """A registry of the two types and of SkillerInterface, whose writer shows the message in execution."""

    def get(self, name: str) -> type[Interface]:
        interface_class: type[Interface]
        for interface_class in (SampleInterface, OtherInterface, SkillerInterface):
            if interface_class.SCHEMA.name == name:
                return interface_class
        raise InterfaceError(f"no interface '{name}'", hint="it is not among the samples")
