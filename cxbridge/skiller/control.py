"""Exclusive control of a Skiller.

The controller is the *source* instance of a message, identified by the text of its serial. The interface's
field ``exclusive_controller`` publishes this text. The log lines have the words of Fawkes.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any
from uuid import UUID

from cxbridge.blackboard.listeners import EventKind, Listener, ListenerTable, listening
from cxbridge.events import Logger
from cxbridge.interfaces.message import UNKNOWN_THREAD

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface, Message


def sender_serial(message: Message) -> str:
    """Return the serial of the original sender."""
    return str(message.source_id)


def sender_name(message: Message) -> str:
    """Return the sender's name for log lines."""
    name = message.sender_thread_name
    return "Remote" if name == UNKNOWN_THREAD else name


class ReaderWatch(Listener):
    """Collects the serials of closed readers of an interface, reported in any thread."""

    def __init__(self, board: BlackBoard) -> None:
        self._board = board
        self._instance: Interface | None = None
        self._closed_serials: deque[str] = deque()

    def listen(self, instance: Interface, table: ListenerTable) -> None:
        """Start watching an interface before its writer opens it."""
        # a reader that requested control and left before the writer listened would have control forever
        self._instance = instance
        listening(self, EventKind.READER_REMOVED)(instance, table)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - a listener's signature
        self._closed_serials.append(str(serial))

    def pop_closed_serial(self) -> str | None:
        """Return the serial of the next closed reader, or None."""
        return self._closed_serials.popleft() if self._closed_serials else None

    def close(self) -> None:
        """Stop watching."""
        if self._instance is not None:
            self._board.unregister_listener(self, self._instance)


class ExclusiveControl:
    """Acquires, steals, releases and revokes control of a Skiller.

    :param interface: the writing instance of SkillerInterface.
    """

    def __init__(self, interface: Any, log: Logger) -> None:
        self._interface = interface
        self._log = log

    @property
    def controller(self) -> str:
        """The serial of the controller; empty without a controller."""
        serial: str = self._interface.exclusive_controller
        return serial

    def may_execute(self, message: Message) -> bool:
        """Return whether the sender is the controller, or the Skiller has no controller."""
        return self.controller in ("", sender_serial(message))

    def admit(self, message: Any, *, is_second: bool, is_running: bool) -> bool:
        """Decide on an ExecSkillMessage and log the decision.

        :param is_second: whether the message replaces an earlier message of the same loop.
        :param is_running: whether a skill string is running, which the message aborts.
        :returns: whether to execute the skill string.
        """
        thread_name, skill_string = message.sender_thread_name, message.skill_string
        if not self.may_execute(message):
            self._log.warn(f"{thread_name} tries to exec, but other thread is controller")
            return False
        former_string = self._interface.skill_string
        if is_second:
            self._log.warn(
                f"More than one skill string enqueued, ignoring previous string ({former_string})."
            )
        if self.controller:
            self._log.info(f"{thread_name} executes '{skill_string}'")
        else:
            self._log.debug(
                f"{sender_name(message)} executes '{skill_string}' without any exclusive controller"
            )
        if is_running:
            self._log.info(f"Aborting execution of previous skill string '{former_string}' for new goal")
        return True

    def acquire(self, message: Any) -> bool:
        """Handle an AcquireControlMessage.

        :returns: whether to write the interface.
        """
        serial, thread_name = sender_serial(message), message.sender_thread_name
        if not self.controller:
            self._log.debug(f"{thread_name} (serial {serial}) is new exclusive controller")
        # logged also if the sender has control already, as in Fawkes
        elif message.steal_control:
            self._log.warn(f"{thread_name} (serial {serial}) steals exclusive control")
        elif self.controller == serial:
            return False
        else:
            self._log.warn(
                f"{thread_name} tried to acquire exclusive control, but another controller exists already"
            )
            return False
        self._interface.exclusive_controller = serial
        return True

    def release(self, message: Message) -> bool:
        """Handle a ReleaseControlMessage.

        :returns: whether to write the interface.
        """
        thread_name = message.sender_thread_name
        if self.controller == sender_serial(message):
            self._log.debug(f"{thread_name} releases exclusive control")
            self._interface.exclusive_controller = ""
            return True
        if self.controller:
            self._log.warn(f"{thread_name} tried to release exclusive control, but it's not the controller")
        return False

    def revoke(self, serial: str) -> bool:
        """Revoke the control of a closed instance. A running skill continues.

        :returns: whether to write the interface.
        """
        if not self.controller or self.controller != serial:
            return False
        self._log.info("Controlling interface instance was closed, revoking exclusive control")
        self._interface.exclusive_controller = ""
        return True
