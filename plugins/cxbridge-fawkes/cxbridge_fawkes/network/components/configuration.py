"""The configuration component: the values of a configuration for ffconfig and similar tools."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import ClassVar, Final

from cxbridge.config import Configuration, ConfigValue
from cxbridge.config.scalars import CONVERTERS, ConfigType, to_uint32
from cxbridge.config.secrets import mask_value
from cxbridge.errors import BlackBoardError
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.configuration import (
    CHANGING_KINDS,
    GET_KINDS,
    PATH_SIZE,
    VALUE_KINDS,
    ConfigKind,
    ConfigMessage,
    unpack_path,
)
from cxbridge_fawkes.network.messages.fields import MAX_ELEMENT_BYTES, pack_list
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler

# the wire has 32 bits for an unsigned integer
_WIRE_CONVERTERS: Final = {**CONVERTERS, ConfigType.UINT: to_uint32}


class ConfigurationComponent(NetworkHandler):
    """Returns values with masked secrets; the configuration is read only for clients."""

    COMPONENT: ClassVar[ComponentId] = ComponentId.CONFIGURATION

    def __init__(self, config: Configuration) -> None:
        self._config: Final = config

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        if frame.kind in GET_KINDS:
            session.send(self._make_value_frame(unpack_path(frame.payload)))
        elif frame.kind == ConfigKind.SUBSCRIBE:
            entries = pack_list(self._list_entries())
            session.send(FawkesFrame(self.COMPONENT, ConfigKind.LIST, entries).to_bytes())
        elif frame.kind in CHANGING_KINDS:
            path = unpack_path(frame.payload)
            session.send(_make_invalid_message(path).to_bytes())  # the client waits for a reply
            raise BlackBoardError(f"cannot change {path}: the configuration is read only for clients")
        elif frame.kind != ConfigKind.UNSUBSCRIBE:  # without changes, a subscription has no effect
            raise MalformedMessageError(f"the configuration has no requests of kind {frame.kind}")

    def _make_value_frame(self, path: str) -> bytes:
        """Return the frame with the value at a path; INV_VALUE for a missing or unsuitable value."""
        if self._config.exists(path):
            with suppress(MalformedMessageError):  # the value does not fit into a message
                return _make_value_message(path, mask_value(self._config.get(path))).to_bytes()
        return _make_invalid_message(path).to_bytes()

    def _list_entries(self) -> Iterator[bytes]:
        """Yield all values that fit into a list, as its elements."""
        for value in self._config.search("/"):
            # a value that the protocol cannot express must not hide the other values
            with suppress(MalformedMessageError):
                entry = _make_value_message(value.path, mask_value(value)).pack_entry()
                if len(entry) <= MAX_ELEMENT_BYTES and len(value.path.encode()) < PATH_SIZE:
                    yield entry


def _make_invalid_message(path: str) -> ConfigMessage:
    return ConfigMessage(ConfigKind.INV_VALUE, path)


def _make_value_message(path: str, value: ConfigValue) -> ConfigMessage:
    """Return the message with a value; with a text if a number does not fit into the 32 bits of the wire."""
    # the wire cannot express an empty list
    if value.is_list and not value.items:
        return ConfigMessage(ConfigKind.STRING_VALUE, path, ("",))
    texts = value.items if value.is_list else (value.text,)
    value_type = value.type
    scalars = tuple(_WIRE_CONVERTERS[value_type](text) for text in texts)
    if any(scalar is None for scalar in scalars):
        value_type, scalars = ConfigType.STRING, texts
    values = tuple(
        scalar for scalar in scalars if scalar is not None
    )  # no scalar is None here: for mypy only
    return ConfigMessage(VALUE_KINDS[value_type], path, values, is_list=value.is_list)
