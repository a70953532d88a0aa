"""The configuration component: the values of a configuration for ffconfig and similar tools."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar, Final

from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages.configuration import (
    DEFAULT_SETS,
    GETS,
    PATH_SIZE,
    SETS,
    VALUE_KINDS,
    ConfigKind,
    ConfigList,
    ConfigMessage,
    Scalar,
    unpack_config,
)
from cxbridge.blackboard.fawkesnet.messages.fields import MAX_ELEMENT
from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame
from cxbridge.blackboard.fawkesnet.session import FawkesSession, NetworkHandler
from cxbridge.config import Configuration, ConfigValue
from cxbridge.config.scalars import ConfigType, to_bool, to_float, to_int, to_uint32
from cxbridge.config.secrets import masked
from cxbridge.errors import BlackBoardError, ConfigError


class ConfigurationComponent(NetworkHandler):
    """Returns values except secrets, sets and resets values for this run, and notifies subscribers.

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
            if frame.kind in _CHANGES:
                session.send(_invalid("?").to_bytes())  # the client waits for a reply
            raise
        if not isinstance(message, ConfigMessage):
            raise BlackBoardError("a client sent a list of values, which only servers do")
        if message.kind in GETS:
            session.send(self._value_message(message.path).to_bytes())
        elif message.kind in _CHANGES:
            try:
                self._change(session, message)
            except (BlackBoardError, ConfigError):
                session.send(_invalid(message.path).to_bytes())  # the client waits for a reply
                raise
        elif message.kind == ConfigKind.SUBSCRIBE:
            self._subscribers.add(session)
            session.send(ConfigList(tuple(self._entries())).to_bytes())
        elif message.kind == ConfigKind.UNSUBSCRIBE:
            self._subscribers.discard(session)
        else:
            raise BlackBoardError(f"a client sent {message.kind.name}, which only servers do")

    def disconnected(self, session: FawkesSession) -> None:
        self._subscribers.discard(session)

    def _change(self, session: FawkesSession, message: ConfigMessage) -> None:
        """Set a value of this run, or erase one.

        :raises BlackBoardError: if clients may not change values, or the message concerns a default: files
            have only values.
        :raises ConfigError: if the path has no such value.
        """
        erases_default = message.kind == ConfigKind.ERASE_VALUE and message.is_default
        if message.kind in DEFAULT_SETS or erases_default:
            raise BlackBoardError(f"{message.kind.name} of {message.path}: not supported")
        if not self._writable:
            verb = "set" if message.kind in SETS else "erase"
            raise BlackBoardError(f"cannot {verb} {message.path}: the configuration is read only for clients")
        if message.kind in SETS:
            values = message.values
            self._config.set(message.path, list(values) if message.is_list else values[0])
            value = self._value_message(message.path).to_bytes()
            for client in self._subscribers | {session}:
                client.send(value)
        else:
            self._erase(session, message.path)

    def _erase(self, session: FawkesSession, path: str) -> None:
        """Erase a value of this run. Subscribers also get the value of the files, which is valid again."""
        self._config.erase(path)
        erased = ConfigMessage(ConfigKind.VALUE_ERASED, path).to_bytes()
        value = self._value_message(path).to_bytes() if self._config.exists(path) else b""
        for subscriber in self._subscribers:
            subscriber.send(erased + value)
        if session not in self._subscribers:
            session.send(erased)

    def _value_message(self, path: str) -> ConfigMessage:
        """Return the message with a value, or INV_VALUE if there is none or it does not fit."""
        if not self._config.exists(path):
            return _invalid(path)
        message = _to_message(path, masked(self._config.get(path)))
        try:
            message.pack()
        except MalformedMessageError:
            return _invalid(path)  # the value does not fit into a message
        return message

    def _entries(self) -> Iterator[ConfigMessage]:
        """Yield all values that fit into a list."""
        for value in self._config.search("/"):
            message = _to_message(value.path, masked(value))
            try:
                fits = len(message.pack_entry()) <= MAX_ELEMENT and len(value.path.encode()) < PATH_SIZE
            except MalformedMessageError:  # a value that the frame cannot express is left out
                continue
            if fits:
                yield message


_CHANGES: Final = frozenset({*SETS, *DEFAULT_SETS, ConfigKind.ERASE_VALUE})


def _invalid(path: str) -> ConfigMessage:
    return ConfigMessage(ConfigKind.INV_VALUE, path)


def _to_message(path: str, value: ConfigValue) -> ConfigMessage:
    """Return the message with a value in its own type, or as text if the type does not fit the wire."""
    # the wire has no empty lists
    if value.is_list and not value.items:
        return ConfigMessage(ConfigKind.STRING_VALUE, path, ("",))
    texts = value.items if value.is_list else (value.text,)
    value_type = value.type
    scalars = tuple(_TO_VALUE[value_type](text) for text in texts)
    if any(scalar is None for scalar in scalars):
        value_type, scalars = ConfigType.STRING, texts
    values = tuple(scalar for scalar in scalars if scalar is not None)
    return ConfigMessage(VALUE_KINDS[value_type], path, values, is_list=value.is_list)


_TO_VALUE: Final[dict[ConfigType, Callable[[str], Scalar | None]]] = {
    ConfigType.UINT: to_uint32,
    ConfigType.INT: to_int,
    ConfigType.FLOAT: to_float,
    ConfigType.BOOL: to_bool,
    ConfigType.STRING: str,
}
