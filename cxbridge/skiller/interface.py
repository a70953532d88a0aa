"""A Skiller's side of its SkillerInterface: from the messages of clients to skill string, status and error.

ExecSkillMessage starts a skill string, StopExecMessage ends it, two more messages acquire and release
exclusive control. The field ``error`` carries the reason for a failure to the executive, whose rules copy it
to the slot ``error-msg`` of skill and plan-action.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch, sender_name
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

_NO_MESSAGE_ID = 0


class InterfaceSkiller(SkillerBackend):
    """Writes ``SkillerInterface::NAME`` and handles its messages; subclasses execute the skill strings.

    :param name: the id of the interface.
    :param component: the name in log lines, and the interface's owner.
    :param find_mapping_place: returns the place of a skill string's action mapping, for log lines; empty if
        the mapping is unknown.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        *,
        name: str,
        component: str,
        find_mapping_place: Callable[[str], str] = lambda _skill_string: "",
    ) -> None:
        super().__init__(name)
        self._board = board
        self._log = bus.logger(component)
        self._find_mapping_place = find_mapping_place
        self._readers = ReaderWatch(board)
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=component, listen=self._readers.listen
        )
        self._control = ExclusiveControl(self._interface, self._log)
        self._has_started_string = False  # in the present loop
        self._handlers = {
            "AcquireControlMessage": self._control.acquire,
            "ReleaseControlMessage": self._control.release,
            "ExecSkillMessage": self._start_skill_string,
            "StopExecMessage": self._stop_skill_string,
        }

    @property
    def running(self) -> bool:
        """Whether a skill string is being executed, or a message is pending."""
        return self.is_executing or not self._interface.msgq_empty()

    @property
    def skill_string(self) -> str:
        """The skill string of the last ExecSkillMessage."""
        return str(self._interface.skill_string)

    @property
    @abstractmethod
    def is_executing(self) -> bool:
        """Whether a skill string is being executed."""

    @abstractmethod
    def start(self, skill_string: str) -> None:
        """Start executing a skill string.

        :raises SkillError: if the skill string is invalid.
        """

    @abstractmethod
    def drop(self) -> None:
        """Stop executing the skill string, without writing a status."""

    def handle_messages(self) -> None:
        """Handle the messages since the last loop, and write the interface once if fields changed."""
        self._has_started_string = is_changed = False
        # first the closed readers: a message may ask for the control that such a reader still has
        while (serial := self._readers.pop_closed_serial()) is not None:
            is_changed |= self._control.revoke(serial)
        while (message := self._interface.msgq_first()) is not None:
            is_changed |= self._handle(message)
            self._interface.msgq_pop()
        if is_changed:
            self._interface.write()

    def end(self, status: Status, error: str = "") -> None:
        """Write the outcome of the skill string, and stop its execution."""
        self._interface.status = status
        self._interface.error = error
        self._interface.write()
        self.drop()

    def close(self) -> None:
        """Stop executing and close the interface."""
        self.drop()
        self._readers.close()
        self._board.close(self._interface)

    def make_mapping_note(self, skill_string: str) -> str:
        """Return a note for log lines with the place of a skill string's action mapping, or an empty text."""
        place = self._find_mapping_place(skill_string)
        return f" (mapped at {place})" if place else ""

    def _handle(self, message: Any) -> bool:
        """Handle a message; return whether to write the interface."""
        handler = self._handlers.get(message.type)
        if handler is None:
            self._log.warn(f"Unhandled message of type {message.type} in skiller interface")
            return False
        return handler(message)

    def _start_skill_string(self, message: Any) -> bool:
        skill_string = message.skill_string
        if not self._control.admit(message, is_second=self._has_started_string, is_running=self.is_executing):
            return False
        if self.is_executing:
            self.drop()
        self._has_started_string = True
        self._interface.skill_string = skill_string
        self._interface.msgid = message.id
        # Fawkes keeps an earlier error until the status changes, so that clients may take the error for a new
        # error
        self._interface.error = ""
        self._interface.status = Status.S_RUNNING
        try:
            self.start(skill_string)
        except SkillError as error:
            self.drop()
            mapping_note = self.make_mapping_note(skill_string)
            self._log.error(f"Failed to compile skill string: {skill_string}|{error.message}{mapping_note}")
            self._interface.error = error.message
            self._interface.status = Status.S_FAILED
        return True

    def _stop_skill_string(self, message: Any) -> bool:
        # unlike in Fawkes, any client may stop the skill string of a Skiller without a controller, because
        # any client may start a skill string
        if not self._control.may_execute(message):
            self._log.debug(f"{sender_name(message)} sent stop without any exclusive controller")
            return False
        self._log.debug(f"Stopping execution of '{self.skill_string}' on request")
        self.drop()
        self._interface.skill_string = ""
        self._interface.msgid = _NO_MESSAGE_ID
        self._interface.status = Status.S_INACTIVE
        return True
