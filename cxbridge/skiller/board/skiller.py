"""The Skiller of an agent, served from the skill board: agents written for the Skiller need no change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.board.local_calls import calls_of
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import MasterState
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch, sender_of
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.board import SkillBoard

LOG_COMPONENT = "SkillBoardSkiller"
_NO_MESSAGE = 0


class BoardSkiller(SkillerBackend):
    """Has skill strings executed by an agent's executors.

    Its writes are those of the Skiller in ``strict`` mode (docs/skiller.md).

    :param skills: the masters; not closed with the Skiller.
    :param agent: the executing agent.
    :param name: id of the SkillerInterface.
    :raises BlackBoardError: when the interface has another writer.
    """

    def __init__(
        self, board: BlackBoard, skills: SkillBoard, bus: EventBus, *, agent: str, name: str = "Skiller"
    ) -> None:
        super().__init__(name)
        self.agent = agent
        self._log = bus.logger(LOG_COMPONENT)
        self._board = board
        self._skills = skills
        self._readers = ReaderWatch(board)
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=LOG_COMPONENT, listen=self._readers.listen
        )
        self._control = ExclusiveControl(self._interface, self._log)
        self._masters: list[Master] = []
        self._enqueued = False
        self._handlers = {
            "AcquireControlMessage": self._control.acquire,
            "ReleaseControlMessage": self._control.release,
            "ExecSkillMessage": self._exec,
            "StopExecMessage": self._stop,
        }

    @property
    def running(self) -> bool:
        """Whether a skill string is being executed or waits to be taken."""
        return bool(self._masters) or not self._interface.msgq_empty()

    def loop(self) -> None:
        """Take the messages, publish changes; the board's loop is the caller's task."""
        self.take()
        self.publish()

    def take(self) -> None:
        """Take the messages."""
        to_write = self._enqueued = False
        while (serial := self._readers.pop()) is not None:
            to_write |= self._control.revoke(serial)
        while (message := self._interface.msgq_pop()) is not None:
            handler = self._handlers.get(message.type)
            if handler is None:
                self._log.warn(f"Unhandled message of type {message.type} in skiller interface")
            else:
                to_write |= handler(message)
        if to_write:
            self._interface.write()

    def publish(self) -> None:
        """Write what became of the skill string."""
        masters = self._masters
        if not masters:
            return
        bad = next((m for m in masters if m.state in (MasterState.FAILED, MasterState.CANCELLED)), None)
        if bad is not None:
            self._end(Status.S_FAILED, bad.error or f"{bad.call.skill} was cancelled")
        elif all(master.is_over for master in masters):
            self._end(Status.S_FINAL)

    def close(self) -> None:
        """Drop the skill string, close the interface."""
        self._drop()
        self._readers.close()
        self._board.close(self._interface)

    # -- messages

    def _exec(self, message: Any) -> bool:
        text = message.skill_string
        if not self._control.admit(message, again=self._enqueued, running=bool(self._masters)):
            return False
        if self._masters:
            self._drop()
        self._enqueued = True
        self._interface.skill_string = text
        self._interface.msgid = message.id
        self._interface.error = ""
        self._interface.status = Status.S_RUNNING
        try:
            for call in calls_of(text, self.agent):
                self._masters.append(self._skills.request(call))
        except SkillError as error:
            self._drop()
            self._log.error(str(error))
            self._interface.error = error.message
            self._interface.status = Status.S_FAILED
        return True

    def _stop(self, message: Any) -> bool:
        if not self._control.may_execute(message):
            self._log.debug(f"{sender_of(message)} sent stop without any exclusive controller")
            return False
        self._log.debug(f"Stopping execution of '{self._interface.skill_string}' on request")
        self._drop()
        self._interface.skill_string = ""
        self._interface.msgid = _NO_MESSAGE
        self._interface.status = Status.S_INACTIVE
        return True

    def _end(self, status: Status, error: str = "") -> None:
        self._drop()
        self._interface.error = error
        self._interface.status = status
        self._interface.write()

    def _drop(self) -> None:
        """Cancel all open work."""
        masters, self._masters = self._masters, []
        for master in masters:
            self._skills.cancel(master)
