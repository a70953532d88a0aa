"""The switch that turns a recording on and off, an interface of the blackboard.

Fawkes' bblogger has the same interface, so that ``ffbblog enable`` and ``ffbblog disable`` work with
cxbridge.
"""

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

_STATES_BY_MESSAGE: Final = {"EnableSwitchMessage": True, "DisableSwitchMessage": False}


class RecordingSwitch(Listener):
    """Writes ``SwitchInterface::BBLogger``, and obeys the messages in the thread of their arrival.

    :param set_recording: starts the recording if its argument is true, otherwise stops the recording.
    :raises BlackBoardError: if the interface has a writer, or cannot be opened.
    """

    def __init__(self, board: BlackBoard, set_recording: Callable[[bool], None], log: Logger) -> None:
        self._set_recording: Final = set_recording
        self._log: Final = log
        self._lock = threading.Lock()
        with self._lock:  # a message may arrive at once and must wait for the first write
            # the class of the interface is made from XML at run time and has no static type
            self._writer: Any = board.open_for_writing(
                SWITCH_TYPE, SWITCH_ID, owner=OWNER, listen=listening(self, EventKind.MESSAGE_RECEIVED)
            )
            self._publish(self._writer, True)

    def message_received(self, interface: Interface, message: Message) -> bool:
        """Switch the recording at once; return False to keep the message out of the queue."""
        enabled = _STATES_BY_MESSAGE.get(message.type)
        if enabled is None:
            self._log.warn(f"{interface.uid} does not support {message.type}: it is either on or off")
            return False
        with self._lock:
            self._set_recording(enabled)
            self._publish(interface, enabled)
        self._log.info("Recording enabled" if enabled else "Recording disabled")
        return False

    @staticmethod
    def _publish(writer: Any, enabled: bool) -> None:
        writer.enabled = enabled
        writer.write()

    def close(self) -> None:
        """Close the switch's interface."""
        with suppress(BlackBoardError):  # the blackboard may be gone already
            self._writer.close()
