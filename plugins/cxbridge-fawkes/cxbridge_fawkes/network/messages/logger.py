"""Messages of the network logger component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import ClassVar, Final, Self

from cxbridge.clock import join_us, split_us
from cxbridge.events import Level
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.fields import WireValue, check_min_size, check_size
from cxbridge_fawkes.network.messages.frames import ComponentId

# Fawkes sends the time in network byte order, but the bit field of level and flags in the host's byte order
_FLAGS_WORD: Final = Struct("=I")
_TIME: Final = Struct(">QI")
_HEAD_SIZE: Final = _FLAGS_WORD.size + _TIME.size
_LEVEL_MASK: Final = 15  # the lowest four bits of the bit field
_EXCEPTION_FLAG: Final = 16  # the bit above the level
_LEVEL_NUMBERS: Final = {Level.DEBUG: 0, Level.INFO: 1, Level.WARN: 2, Level.ERROR: 4}
_LEVELS_BY_NUMBER: Final = {number: level for level, number in _LEVEL_NUMBERS.items()}


class LogKind(IntEnum):
    """Kinds of messages."""

    SUBSCRIBE = 1
    UNSUBSCRIBE = 2
    LOGMESSAGE = 3


@dataclass(frozen=True, slots=True)
class LogSubscription(WireValue):
    """A client's subscription of log lines.

    :param subscribe: True to subscribe, False to unsubscribe.
    """

    subscribe: bool

    COMPONENT: ClassVar[ComponentId] = ComponentId.NETWORK_LOGGER

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return LogKind.SUBSCRIBE if self.subscribe else LogKind.UNSUBSCRIBE

    def pack(self) -> bytes:
        return b""


@dataclass(frozen=True, slots=True)
class LogMessage(WireValue):
    """A log line.

    :param time_us: microseconds since the epoch.
    :param exception: whether the text describes an exception.
    """

    time_us: int
    level: Level
    component: str
    text: str
    exception: bool = False

    COMPONENT: ClassVar[ComponentId] = ComponentId.NETWORK_LOGGER

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return LogKind.LOGMESSAGE

    def pack(self) -> bytes:
        word = _LEVEL_NUMBERS[self.level] | (_EXCEPTION_FLAG if self.exception else 0)
        seconds, microseconds = split_us(max(self.time_us, 0))
        texts = (text.encode(errors="replace").replace(b"\0", b"?") for text in (self.component, self.text))
        return _FLAGS_WORD.pack(word) + _TIME.pack(seconds, microseconds) + b"%s\0%s\0" % tuple(texts)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        check_min_size(payload, _HEAD_SIZE + 2, "LOGMESSAGE")  # two empty texts with a NUL each
        (word,) = _FLAGS_WORD.unpack_from(payload)
        seconds, microseconds = _TIME.unpack_from(payload, _FLAGS_WORD.size)
        texts = payload[_HEAD_SIZE:].split(b"\0")
        if len(texts) != 3 or texts[2]:  # noqa: PLR2004 - component, text, nothing after the last NUL
            raise MalformedMessageError("LOGMESSAGE must have two texts, each with a NUL at its end")
        component, text = (raw.decode(errors="backslashreplace") for raw in texts[:2])
        number = word & _LEVEL_MASK
        level = _LEVELS_BY_NUMBER.get(number)
        if level is None:
            raise MalformedMessageError(f"LOGMESSAGE has the unknown level {number}")
        return cls(join_us(seconds, microseconds), level, component, text, bool(word & _EXCEPTION_FLAG))


def unpack_log(kind: int, payload: bytes) -> LogSubscription | LogMessage:
    """Parse a message of the network logger component.

    :raises MalformedMessageError: if the kind is unknown or the bytes are invalid.
    """
    if kind == LogKind.LOGMESSAGE:
        return LogMessage.unpack(payload)
    if kind in (LogKind.SUBSCRIBE, LogKind.UNSUBSCRIBE):
        check_size(payload, 0, "SUBSCRIBE")
        return LogSubscription(kind == LogKind.SUBSCRIBE)
    raise MalformedMessageError(f"the network logger has no messages of kind {kind}")
