"""Exclusive control: who may command a Skiller.

The controller is the *source* instance of a message, known by the text of its serial; it is kept in the
interface's field ``exclusive_controller``, where everybody can see it.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any
from uuid import UUID

from cxbridge.blackboard.listeners import EventKind, Listener, ListenerTable, listening
from cxbridge.events import Logger

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface, Message

UNKNOWN_SENDER = "Unknown"
"""Thread name of a sender on another host."""


def serial_of(message: Message) -> str:
    """Return the serial of the instance that sent ``message`` first."""
    return str(message.source_id)


def sender_of(message: Message) -> str:
    """Return the name of the sender for log lines about its actions without control."""
    name = message.sender_thread_name
    return "Remote" if name == UNKNOWN_SENDER else name


class ReaderWatch(Listener):
    """Collects the serials of instances that stopped reading an interface, in whatever thread it happens."""

    def __init__(self, board: BlackBoard) -> None:
        self._board = board
        self._instance: Interface | None = None
        self._gone: deque[str] = deque()

    def listen(self, instance: Interface, table: ListenerTable) -> None:
        """Watch the readers of an interface, for its writer, from before it is open.

        Who asked for control and left before the writer listened had control forever.
        """
        self._instance = instance
        listening(self, EventKind.READER_REMOVED)(instance, table)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - a listener's signature
        """Note that a reader is gone."""
        self._gone.append(str(serial))

    def pop(self) -> str | None:
        """Return the serial of the next reader that is gone, None when there is none."""
        return self._gone.popleft() if self._gone else None

    def close(self) -> None:
        """Watch no more."""
        if self._instance is not None:
            self._board.unregister_listener(self, self._instance)


class ExclusiveControl:
    """The controller of a Skiller: acquires, steals, releases and revokes control.

    :param interface: the writing instance of SkillerInterface.
    """

    def __init__(self, interface: Any, log: Logger) -> None:
        self._interface = interface
        self._log = log

    @property
    def controller(self) -> str:
        """The serial of the controller, empty when there is none."""
        serial: str = self._interface.exclusive_controller
        return serial

    def is_held_by(self, message: Message) -> bool:
        """Whether the sender of ``message`` is the controller."""
        return self.controller == serial_of(message)

    def may_execute(self, message: Message) -> bool:
        """Whether the sender of ``message`` is the controller, or there is no controller."""
        return self.controller in ("", serial_of(message))

    def admit(self, message: Any, *, again: bool, running: bool) -> bool:
        """Decide on an ExecSkillMessage, and log the result.

        :param again: there was another one in this loop, which is ignored.
        :param running: a skill string runs, which is aborted.
        :returns: whether the skill string is to be executed.
        """
        thread, text = message.sender_thread_name, message.skill_string
        if not self.may_execute(message):
            self._log.warn(f"{thread} tries to exec, but other thread is controller")
            return False
        before = self._interface.skill_string
        if again:
            self._log.warn(f"More than one skill string enqueued, ignoring previous string ({before}).")
        if self.controller:
            self._log.info(f"{thread} executes '{text}'")
        else:
            self._log.debug(f"{sender_of(message)} executes '{text}' without any exclusive controller")
        if running:
            self._log.info(f"Aborting execution of previous skill string '{before}' for new goal")
        return True

    def acquire(self, message: Any) -> bool:
        """Act on an AcquireControlMessage.

        :returns: whether the interface is to be written.
        """
        serial, thread = serial_of(message), message.sender_thread_name
        if not self.controller:
            self._log.debug(f"{thread} (serial {serial}) is new exclusive controller")
        elif message.steal_control:
            self._log.warn(f"{thread} (serial {serial}) steals exclusive control")
        elif self.controller == serial:
            return False
        else:
            self._log.warn(
                f"{thread} tried to acquire exclusive control, but another controller exists already"
            )
            return False
        self._interface.exclusive_controller = serial
        return True

    def release(self, message: Message) -> bool:
        """Act on a ReleaseControlMessage.

        :returns: whether the interface is to be written.
        """
        thread = message.sender_thread_name
        if self.is_held_by(message):
            self._log.debug(f"{thread} releases exclusive control")
            self._interface.exclusive_controller = ""
            return True
        if self.controller:
            self._log.warn(f"{thread} tried to release exclusive control, but it's not the controller")
        return False

    def revoke(self, serial: str) -> bool:
        """Take control away from an instance that is closed; a running skill continues.

        :returns: whether the interface is to be written.
        """
        if not self.controller or self.controller != serial:
            return False
        self._log.info("Controlling interface instance was closed, revoking exclusive control")
        self._interface.exclusive_controller = ""
        return True
