"""Messages of the network logger component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import ClassVar, Final

from cxbridge.clock import split_us
from cxbridge.events import Level
from cxbridge_fawkes.network.messages.fields import WireValue
from cxbridge_fawkes.network.messages.frames import ComponentId

# Fawkes sends the time in network byte order, but the bit field of level and flags in the host's byte order
_FLAGS_WORD: Final = Struct("=I")
_TIME: Final = Struct(">QI")  # seconds and microseconds
_LEVEL_NUMBERS: Final = {Level.DEBUG: 0, Level.INFO: 1, Level.WARN: 2, Level.ERROR: 4}


class LogKind(IntEnum):
    """Kinds of messages."""

    SUBSCRIBE = 1
    UNSUBSCRIBE = 2
    LOGMESSAGE = 3


@dataclass(frozen=True, slots=True)
class LogMessage(WireValue):
    """A log line.

    :param time_us: microseconds since the epoch.
    """

    time_us: int
    level: Level
    component: str
    text: str

    COMPONENT: ClassVar[ComponentId] = ComponentId.NETWORK_LOGGER

    @property
    def message_kind(self) -> int:
        """The number of the message within its component."""
        return LogKind.LOGMESSAGE

    def pack(self) -> bytes:
        seconds, microseconds = split_us(max(self.time_us, 0))  # the wire has unsigned seconds
        # a NUL ends a text on the wire
        texts = (text.encode(errors="replace").replace(b"\0", b"?") for text in (self.component, self.text))
        head = _FLAGS_WORD.pack(_LEVEL_NUMBERS[self.level]) + _TIME.pack(seconds, microseconds)
        return head + b"%s\0%s\0" % tuple(texts)
