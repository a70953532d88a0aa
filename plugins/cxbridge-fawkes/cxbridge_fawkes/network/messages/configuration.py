"""Messages of the configuration component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from struct import error as StructError  # noqa: N812 - the name of a class
from typing import ClassVar, Final, Self

from cxbridge.config.scalars import ConfigType
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.fields import (
    WireValue,
    check_min_size,
    check_size,
    pack_list,
    pack_text,
    unpack_list,
    unpack_text,
)
from cxbridge_fawkes.network.messages.frames import ComponentId

PATH_SIZE: Final = 128  # bytes of Fawkes' C struct
_DESCRIPTOR: Final = Struct(f"={PATH_SIZE}sHH")
_ENTRY_KIND: Final = Struct("=I")
_STRING_HEAD: Final = Struct("=HH")  # the length, and two unused bytes
_DEFAULT_FLAG: Final = 1  # the only flag that Fawkes uses
_MAX_STRING_BYTES: Final = 0xFFFF  # the length of a string has 16 bits

Scalar = bool | int | float | str


class ConfigKind(IntEnum):
    """Kinds of messages; Fawkes has the same gaps between the numbers."""

    GET_FLOAT = 1
    GET_UINT = 2
    GET_INT = 3
    GET_BOOL = 4
    GET_STRING = 5
    GET_VALUE = 6
    SET_FLOAT = 10
    SET_UINT = 11
    SET_INT = 12
    SET_BOOL = 13
    SET_STRING = 14
    SET_DEFAULT_FLOAT = 16
    SET_DEFAULT_UINT = 17
    SET_DEFAULT_INT = 18
    SET_DEFAULT_BOOL = 19
    SET_DEFAULT_STRING = 20
    ERASE_VALUE = 22
    FLOAT_VALUE = 30
    UINT_VALUE = 31
    INT_VALUE = 32
    BOOL_VALUE = 33
    STRING_VALUE = 34
    INV_VALUE = 36
    VALUE_ERASED = 37
    LIST = 38
    SUBSCRIBE = 50
    UNSUBSCRIBE = 51


_TYPES: Final = (ConfigType.FLOAT, ConfigType.UINT, ConfigType.INT, ConfigType.BOOL, ConfigType.STRING)
_FORMATS: Final = {ConfigType.FLOAT: "f", ConfigType.UINT: "I", ConfigType.INT: "i", ConfigType.BOOL: "i"}

GET_KINDS: Final = frozenset(kind for kind in ConfigKind if kind <= ConfigKind.GET_VALUE)
SET_TYPES: Final = {ConfigKind(ConfigKind.SET_FLOAT + index): kind for index, kind in enumerate(_TYPES)}
"""The value's type in each kind of message that sets a value."""
SET_DEFAULT_TYPES: Final = {
    ConfigKind(ConfigKind.SET_DEFAULT_FLOAT + index): kind for index, kind in enumerate(_TYPES)
}
"""The value's type in each kind of message that sets a default."""
VALUE_TYPES: Final = {ConfigKind(ConfigKind.FLOAT_VALUE + index): kind for index, kind in enumerate(_TYPES)}
"""The value's type in each kind of message that contains a value."""
VALUE_KINDS: Final = {kind: message for message, kind in VALUE_TYPES.items()}
_VALUE_TYPES_BY_KIND: Final = SET_TYPES | SET_DEFAULT_TYPES | VALUE_TYPES
_PATHLESS_KINDS: Final = frozenset({ConfigKind.SUBSCRIBE, ConfigKind.UNSUBSCRIBE})


@dataclass(frozen=True, slots=True)
class ConfigMessage(WireValue):
    """A message about one path; SUBSCRIBE and UNSUBSCRIBE have no path.

    :param path: the path, of at most 127 bytes.
    :param is_list: whether the value is a list. On the wire, an empty list looks like a scalar.
    :param is_default: whether the message is about the default instead of the value.
    """

    kind: ConfigKind
    path: str = ""
    values: tuple[Scalar, ...] = ()
    is_list: bool = False
    is_default: bool = False

    COMPONENT: ClassVar[ComponentId] = ComponentId.CONFIGURATION

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return self.kind

    def pack(self) -> bytes:
        """Return the payload.

        :raises MalformedMessageError: if a value does not fit its type on the wire.
        """
        if self.kind in _PATHLESS_KINDS:
            return b""
        return self._pack_descriptor() + self._pack_values()

    def pack_entry(self) -> bytes:
        """Return the message as an element of LIST.

        :raises MalformedMessageError: if a value does not fit its type on the wire.
        """
        return self._pack_descriptor() + _ENTRY_KIND.pack(self.kind) + self._pack_values()

    @classmethod
    def unpack(cls, kind: int, payload: bytes) -> Self:
        """Parse a message.

        :raises MalformedMessageError: if the kind is unknown or the bytes are invalid.
        """
        try:
            message_kind = ConfigKind(kind)
        except ValueError:
            raise MalformedMessageError(f"the configuration has no messages of kind {kind}") from None
        if message_kind in _PATHLESS_KINDS:
            check_size(payload, 0, message_kind.name)
            return cls(message_kind)
        return cls._unpack(message_kind, payload, _DESCRIPTOR.size)

    @classmethod
    def unpack_entry(cls, element: bytes) -> Self:
        check_min_size(element, _DESCRIPTOR.size + _ENTRY_KIND.size, "an element of LIST")
        # only the lowest byte of the word is the kind
        number = _ENTRY_KIND.unpack_from(element, _DESCRIPTOR.size)[0] & 0xFF
        if number not in VALUE_TYPES:
            raise MalformedMessageError(f"an element of LIST has the unknown type {number}")
        return cls._unpack(ConfigKind(number), element, _DESCRIPTOR.size + _ENTRY_KIND.size)

    @classmethod
    def _unpack(cls, kind: ConfigKind, payload: bytes, start: int) -> Self:
        value_type = _VALUE_TYPES_BY_KIND.get(kind)
        check_min_size(payload, start, kind.name)
        raw_path, flags, count = _DESCRIPTOR.unpack_from(payload)
        path, is_default = unpack_text(raw_path), bool(flags & _DEFAULT_FLAG)
        if value_type is None:
            check_size(payload, start, kind.name)
            return cls(kind, path, is_default=is_default)  # Fawkes leaves the count undefined without values
        # the wire marks a scalar by the count 0
        values = _unpack_values(value_type, payload[start:], max(count, 1), kind.name)
        return cls(kind, path, values, count > 0, is_default)

    def _pack_descriptor(self) -> bytes:
        count = len(self.values) if self.is_list else 0
        flags = _DEFAULT_FLAG if self.is_default else 0
        return _DESCRIPTOR.pack(pack_text(self.path, PATH_SIZE), flags, count)

    def _pack_values(self) -> bytes:
        value_type = _VALUE_TYPES_BY_KIND.get(self.kind)
        if value_type is None:
            return b""
        if value_type is ConfigType.STRING:
            terminated = self.is_list or self.kind in VALUE_TYPES  # as in Fawkes, see `_unpack_strings`
            return b"".join(_pack_string(str(value), terminated=terminated) for value in self.values)
        try:
            return Struct(f"={len(self.values)}{_FORMATS[value_type]}").pack(*self.values)
        except (StructError, OverflowError) as error:
            raise MalformedMessageError(f"{self.path}: {error}") from None


@dataclass(frozen=True, slots=True)
class ConfigList(WireValue):
    """All values of a configuration, the reply to SUBSCRIBE."""

    entries: tuple[ConfigMessage, ...]

    COMPONENT: ClassVar[ComponentId] = ComponentId.CONFIGURATION

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return ConfigKind.LIST

    def pack(self) -> bytes:
        return pack_list(entry.pack_entry() for entry in self.entries)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        return cls(tuple(map(ConfigMessage.unpack_entry, unpack_list(payload, "LIST"))))


def unpack_config(kind: int, payload: bytes) -> ConfigMessage | ConfigList:
    """Parse a message of the configuration component.

    :raises MalformedMessageError: if the kind is unknown or the bytes are invalid.
    """
    return ConfigList.unpack(payload) if kind == ConfigKind.LIST else ConfigMessage.unpack(kind, payload)


def _pack_string(text: str, *, terminated: bool) -> bytes:
    raw = text.encode(errors="replace")
    if len(raw) > _MAX_STRING_BYTES:
        raise MalformedMessageError(f"a text of {len(raw)} bytes is longer than {_MAX_STRING_BYTES} bytes")
    return _STRING_HEAD.pack(len(raw), 0) + raw + (b"\0" if terminated else b"")


def _unpack_values(value_type: ConfigType, raw: bytes, count: int, subject: str) -> tuple[Scalar, ...]:
    if value_type is ConfigType.STRING:
        return tuple(_unpack_strings(raw, count, subject))
    check_size(raw, 4 * count, f"the value of {subject}")
    values: tuple[Scalar, ...] = Struct(f"={count}{_FORMATS[value_type]}").unpack(raw)
    return tuple(map(bool, values)) if value_type is ConfigType.BOOL else values


def _unpack_strings(raw: bytes, count: int, subject: str) -> Iterator[str]:
    """Yield texts. The last NUL is optional, because Fawkes' clients omit it when they set a single text."""
    start = 0
    for index in range(count):
        check_min_size(raw[start:], _STRING_HEAD.size, f"a text of {subject}")
        length, _ = _STRING_HEAD.unpack_from(raw, start)
        start += _STRING_HEAD.size
        text = raw[start : start + length]
        check_size(text, length, f"a text of {subject}")
        yield text.decode(errors="backslashreplace")
        start += length
        if index < count - 1 or start < len(raw):
            check_size(raw[start : start + 1].rstrip(b"\0"), 0, f"the end of a text of {subject}")
            start += 1
    check_size(raw, start, f"the texts of {subject}")
