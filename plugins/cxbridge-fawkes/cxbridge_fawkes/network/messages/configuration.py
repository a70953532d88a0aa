"""Messages of the configuration component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from struct import error as StructError  # noqa: N812 - the name of a class
from typing import ClassVar, Final

from cxbridge.config.scalars import ConfigType
from cxbridge.trace.formats.block_decoder import decode_padded_text
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.fields import (
    WireValue,
    check_min_size,
    pack_text,
)
from cxbridge_fawkes.network.messages.frames import ComponentId

PATH_SIZE: Final = 128  # bytes of Fawkes' C struct
_DESCRIPTOR: Final = Struct(f"={PATH_SIZE}sHH")  # the path, a flag of default values, the number of items
_ENTRY_KIND: Final = Struct("=I")
_STRING_HEAD: Final = Struct("=HH")  # the length, and two unused bytes
_MAX_STRING_BYTES: Final = 0xFFFF  # the length of a string has 16 bits

Scalar = bool | int | float | str

GET_KINDS: Final = range(1, 7)
"""Requests of a float, uint, int, bool, string, or of a value of any type."""

CHANGING_KINDS: Final = range(10, 23)
"""Requests that set a value, a default or a comment, or erase a value."""


class ConfigKind(IntEnum):
    """The supported kinds of messages other than `GET_KINDS` and `CHANGING_KINDS`."""

    FLOAT_VALUE = 30
    UINT_VALUE = 31
    INT_VALUE = 32
    BOOL_VALUE = 33
    STRING_VALUE = 34
    INV_VALUE = 36
    LIST = 38
    SUBSCRIBE = 50
    UNSUBSCRIBE = 51


VALUE_KINDS: Final = {
    ConfigType.FLOAT: ConfigKind.FLOAT_VALUE,
    ConfigType.UINT: ConfigKind.UINT_VALUE,
    ConfigType.INT: ConfigKind.INT_VALUE,
    ConfigType.BOOL: ConfigKind.BOOL_VALUE,
    ConfigType.STRING: ConfigKind.STRING_VALUE,
}
"""The kind of the message with a value of each type."""

# the struct format of a value by the kind of its message; texts have no fixed size
_FORMATS: Final = {
    ConfigKind.FLOAT_VALUE: "f",
    ConfigKind.UINT_VALUE: "I",
    ConfigKind.INT_VALUE: "i",
    ConfigKind.BOOL_VALUE: "i",  # 32 bits, as in Fawkes
}


def unpack_path(payload: bytes) -> str:
    """Return the path of a request.

    :raises MalformedMessageError: if the payload is too short.
    """
    check_min_size(payload, _DESCRIPTOR.size, "a request of the configuration")
    return decode_padded_text(payload[:PATH_SIZE])


@dataclass(frozen=True, slots=True)
class ConfigMessage(WireValue):
    """The reply about one path.

    :param path: the path; `pack` cuts it to 127 bytes.
    :param values: the value, or the items of a list; empty for INV_VALUE.
    """

    kind: ConfigKind
    path: str
    values: tuple[Scalar, ...] = ()
    is_list: bool = False

    COMPONENT: ClassVar[ComponentId] = ComponentId.CONFIGURATION

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return self.kind

    def pack(self) -> bytes:
        """Return the payload.

        :raises MalformedMessageError: if a value does not fit its type on the wire.
        """
        return self._pack_descriptor() + self._pack_values()

    def pack_entry(self) -> bytes:
        """Return the message as an element of LIST.

        :raises MalformedMessageError: if a value does not fit its type on the wire.
        """
        return self._pack_descriptor() + _ENTRY_KIND.pack(self.kind) + self._pack_values()

    def _pack_descriptor(self) -> bytes:
        count = len(self.values) if self.is_list else 0  # the wire marks a scalar by the count 0
        return _DESCRIPTOR.pack(pack_text(self.path, PATH_SIZE), 0, count)

    def _pack_values(self) -> bytes:
        if self.kind not in _FORMATS:
            return b"".join(_pack_string(str(value)) for value in self.values)
        try:
            return Struct(f"={len(self.values)}{_FORMATS[self.kind]}").pack(*self.values)
        except (StructError, OverflowError) as error:
            raise MalformedMessageError(f"{self.path}: {error}") from None


def _pack_string(text: str) -> bytes:
    encoded_text = text.encode(errors="replace")
    if len(encoded_text) > _MAX_STRING_BYTES:
        raise MalformedMessageError(
            f"a text of {len(encoded_text)} bytes is longer than {_MAX_STRING_BYTES} bytes"
        )
    return _STRING_HEAD.pack(len(encoded_text), 0) + encoded_text + b"\0"
