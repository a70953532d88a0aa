"""The switch of a recording on the blackboard, as Fawkes' bblogger has it: ``ffbblog enable`` talks to it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from cxbridge.blackboard import BlackBoard, EventKind, Listener, listening
from cxbridge.errors import BlackBoardError
from cxbridge.events import Logger
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message

SWITCH_TYPE: Final = "SwitchInterface"
SWITCH_ID: Final = "BBLogger"
OWNER: Final = "bblogger"

_WANTED: Final = {"EnableSwitchMessage": True, "DisableSwitchMessage": False}


class RecordingSwitch(Listener):
    """Writes ``SwitchInterface::BBLogger`` and obeys its messages, in the thread that they come in.

    :param switch: called with whether to record.
    :param log: for people.
    :raises BlackBoardError: when the interface has another writer, or cannot be opened.
    """

    def __init__(self, board: BlackBoard, switch: Callable[[bool], None], log: Logger) -> None:
        self._switch: Final = switch
        self._log: Final = log
        self._lock = threading.Lock()
        with self._lock:  # who switches at once comes after this
            # The fields of the interface come from its XML definition: there is no static type for them here.
            self._writer: Any = board.open_for_writing(
                SWITCH_TYPE, SWITCH_ID, owner=OWNER, listen=listening(self, EventKind.MESSAGE_RECEIVED)
            )
            self._show(self._writer, True)

    def message_received(self, interface: Interface, message: Message) -> bool:
        """Switch, at once; no message is queued."""
        enabled = _WANTED.get(message.type)
        if enabled is None:
            self._log.warn(f"{interface.uid} knows no {message.type}: it is either on or off")
            return False
        with self._lock:
            self._switch(enabled)
            self._show(interface, enabled)
        self._log.info("Recording enabled" if enabled else "Recording disabled")
        return False

    @staticmethod
    def _show(writer: Any, enabled: bool) -> None:
        writer.enabled = enabled
        writer.write()

    def close(self) -> None:
        """Take the switch off the blackboard."""
        with suppress(BlackBoardError):
            self._writer.close()
