"""The configuration component: the values of a configuration for ffconfig and similar tools."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar, Final

from cxbridge.config import Configuration, ConfigValue
from cxbridge.config.scalars import ConfigType, to_bool, to_float, to_int, to_uint32
from cxbridge.config.secrets import mask_value
from cxbridge.errors import BlackBoardError, ConfigError
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.configuration import (
    GET_KINDS,
    PATH_SIZE,
    SET_DEFAULT_TYPES,
    SET_TYPES,
    VALUE_KINDS,
    ConfigKind,
    ConfigList,
    ConfigMessage,
    Scalar,
    unpack_config,
)
from cxbridge_fawkes.network.messages.fields import MAX_ELEMENT_BYTES
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler


class ConfigurationComponent(NetworkHandler):
    """Returns values with masked secrets, sets and erases values of this run, and notifies subscribers.

    :param config: the configuration, changed in the server's thread.
    :param writable: whether clients may set and erase values.
    """

    COMPONENT: ClassVar[ComponentId] = ComponentId.CONFIGURATION

    def __init__(self, config: Configuration, *, writable: bool = True) -> None:
        self._config: Final = config
        self._writable: Final = writable
        self._subscribers: set[FawkesSession] = set()

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        try:
            message = unpack_config(frame.kind, frame.payload)
        except MalformedMessageError:
            if frame.kind in _CHANGING_KINDS:
                session.send(_make_invalid_message("?").to_bytes())  # the client waits for a reply
            raise
        if not isinstance(message, ConfigMessage):
            raise BlackBoardError("a client sent a list of values, which only servers do")
        if message.kind in GET_KINDS:
            session.send(self._find_value_message(message.path).to_bytes())
        elif message.kind in _CHANGING_KINDS:
            try:
                self._apply_change(session, message)
            except (BlackBoardError, ConfigError):
                session.send(_make_invalid_message(message.path).to_bytes())  # the client waits for a reply
                raise
        elif message.kind == ConfigKind.SUBSCRIBE:
            self._subscribers.add(session)
            session.send(ConfigList(tuple(self._list_messages())).to_bytes())
        elif message.kind == ConfigKind.UNSUBSCRIBE:
            self._subscribers.discard(session)
        else:
            raise BlackBoardError(f"a client sent {message.kind.name}, which only servers do")

    def disconnected(self, session: FawkesSession) -> None:
        self._subscribers.discard(session)

    def _apply_change(self, session: FawkesSession, message: ConfigMessage) -> None:
        """Set or erase a value of this run.

        :raises BlackBoardError: if clients may not change values, or the message is about a default, which
            cxbridge's configuration does not have.
        :raises ConfigError: if the path cannot have the value.
        """
        erases_default = message.kind == ConfigKind.ERASE_VALUE and message.is_default
        if message.kind in SET_DEFAULT_TYPES or erases_default:
            raise BlackBoardError(f"{message.kind.name} of {message.path}: not supported")
        if not self._writable:
            verb = "set" if message.kind in SET_TYPES else "erase"
            raise BlackBoardError(f"cannot {verb} {message.path}: the configuration is read only for clients")
        if message.kind in SET_TYPES:
            values = message.values
            self._config.set(message.path, list(values) if message.is_list else values[0])
            value = self._find_value_message(message.path).to_bytes()
            for client in self._subscribers | {session}:
                client.send(value)
        else:
            self._erase(session, message.path)

    def _erase(self, session: FawkesSession, path: str) -> None:
        """Erase a value of this run. Subscribers also get the value of the files, which applies again."""
        self._config.erase(path)
        erased = ConfigMessage(ConfigKind.VALUE_ERASED, path).to_bytes()
        value = self._find_value_message(path).to_bytes() if self._config.exists(path) else b""
        for subscriber in self._subscribers:
            subscriber.send(erased + value)
        if session not in self._subscribers:
            session.send(erased)

    def _find_value_message(self, path: str) -> ConfigMessage:
        """Return the message with the value at a path; INV_VALUE if no value exists or it does not fit."""
        if not self._config.exists(path):
            return _make_invalid_message(path)
        message = _make_value_message(path, mask_value(self._config.get(path)))
        try:
            message.pack()
        except MalformedMessageError:
            return _make_invalid_message(path)  # the value does not fit into a message
        return message

    def _list_messages(self) -> Iterator[ConfigMessage]:
        """Yield the messages of all values that fit into a list."""
        for value in self._config.search("/"):
            message = _make_value_message(value.path, mask_value(value))
            try:
                fits = len(message.pack_entry()) <= MAX_ELEMENT_BYTES and len(value.path.encode()) < PATH_SIZE
            except MalformedMessageError:
                continue  # a value that the protocol cannot express must not hide the other values
            if fits:
                yield message


_CHANGING_KINDS: Final = frozenset({*SET_TYPES, *SET_DEFAULT_TYPES, ConfigKind.ERASE_VALUE})


def _make_invalid_message(path: str) -> ConfigMessage:
    return ConfigMessage(ConfigKind.INV_VALUE, path)


def _make_value_message(path: str, value: ConfigValue) -> ConfigMessage:
    """Return the message with a value; with a text if a number does not fit into the 32 bits of the wire."""
    # the wire cannot express an empty list
    if value.is_list and not value.items:
        return ConfigMessage(ConfigKind.STRING_VALUE, path, ("",))
    texts = value.items if value.is_list else (value.text,)
    value_type = value.type
    scalars = tuple(_VALUE_PARSERS[value_type](text) for text in texts)
    if any(scalar is None for scalar in scalars):
        value_type, scalars = ConfigType.STRING, texts
    values = tuple(scalar for scalar in scalars if scalar is not None)
    return ConfigMessage(VALUE_KINDS[value_type], path, values, is_list=value.is_list)


_VALUE_PARSERS: Final[dict[ConfigType, Callable[[str], Scalar | None]]] = {
    ConfigType.UINT: to_uint32,
    ConfigType.INT: to_int,
    ConfigType.FLOAT: to_float,
    ConfigType.BOOL: to_bool,
    ConfigType.STRING: str,
}
