"""Messages of the plugin manager component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, Final, Self

from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.fields import (
    MAX_ELEMENT_BYTES,
    WireValue,
    check_size,
    pack_list,
    pack_text,
    unpack_list,
    unpack_text,
)
from cxbridge_fawkes.network.messages.frames import ComponentId

NAME_SIZE: Final = 32  # bytes of Fawkes' C struct


class PluginKind(IntEnum):
    """Kinds of messages."""

    LOAD = 1
    LOADED = 2
    LOAD_FAILED = 3
    UNLOAD = 4
    UNLOADED = 5
    UNLOAD_FAILED = 6
    LIST_AVAIL = 7
    AVAIL_LIST = 8
    AVAIL_LIST_FAILED = 9
    LIST_LOADED = 10
    LOADED_LIST = 11
    LOADED_LIST_FAILED = 12
    SUBSCRIBE_WATCH = 13
    UNSUBSCRIBE_WATCH = 14


NAMED_KINDS: Final = frozenset(list(PluginKind)[:6])  # LOAD to UNLOAD_FAILED
"""Kinds with the name of a plugin."""
LIST_KINDS: Final = frozenset({PluginKind.AVAIL_LIST, PluginKind.LOADED_LIST})
"""Kinds with a list of texts."""


@dataclass(frozen=True, slots=True)
class PluginMessage(WireValue):
    """A message of the plugin manager.

    :param name: the name of the plugin, for the kinds in :data:`NAMED_KINDS`.
    :param items: the texts of the kinds in :data:`LIST_KINDS`: names, or alternating names and descriptions.
    """

    # one class for all kinds, because each kind has at most one of the two fields
    kind: PluginKind
    name: str = ""
    items: tuple[str, ...] = ()

    COMPONENT: ClassVar[ComponentId] = ComponentId.PLUGIN_MANAGER

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return self.kind

    def pack(self) -> bytes:
        if self.kind in NAMED_KINDS:
            return pack_text(self.name, NAME_SIZE)
        if self.kind in LIST_KINDS:
            return pack_list(text.encode(errors="replace")[:MAX_ELEMENT_BYTES] for text in self.items)
        return b""

    @classmethod
    def unpack(cls, kind: int, payload: bytes) -> Self:
        """Parse a message.

        :raises MalformedMessageError: if the kind is unknown or the bytes are invalid.
        """
        try:
            message_kind = PluginKind(kind)
        except ValueError:
            raise MalformedMessageError(f"the plugin manager has no messages of kind {kind}") from None
        if message_kind in NAMED_KINDS:
            check_size(payload, NAME_SIZE, message_kind.name)
            return cls(message_kind, name=unpack_text(payload))
        if message_kind in LIST_KINDS:
            return cls(message_kind, items=tuple(map(unpack_text, unpack_list(payload, message_kind.name))))
        check_size(payload, 0, message_kind.name)
        return cls(message_kind)
