"""Choices about the inputs of an agent: sensed values and messages."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Final

from cxbridge.blackboard import LocalBlackBoard, parse_uid
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import EventKind, Listener
from cxbridge.closing import Closing
from cxbridge.errors import ConfigError, InterfaceError
from cxbridge.events import Event, SkillStatus
from cxbridge.interfaces.assignments import assign
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message
from cxbridge.run.agent import Run
from cxbridge_explore.worldmodel.model import MessageFault, SensedValue
from cxbridge_explore.worlds.asking import Asking, fault, unless
from cxbridge_explore.worlds.points import ChoiceKind, Option

_SKILL: Final = re.compile(r"\w+")
OWNER: Final = "world"  # owner of the interfaces that the world opens

_ENDED: Final = ("S_FINAL", "S_FAILED")


class SensedChoices:
    """Writes chosen values to a field of an interface.

    :param interface: the interface, open for writing.
    :param prefix: the prefix of its subjects.
    :raises ConfigError: if a value does not fit the field.
    """

    def __init__(
        self, sensed: SensedValue, agent: Run, interface: Interface, ask: Asking, prefix: str
    ) -> None:
        self._sensed, self._interface, self._ask = sensed, interface, ask
        for text, _ in reversed(sensed.values):
            try:
                self._set(text)
            except InterfaceError as error:
                place = sensed.place
                raise ConfigError(error.message, file=place.file, line=place.line, hint=error.hint) from None
        self._subject = f"{prefix}{sensed.uid}.{sensed.name}"
        self._at = list(sensed.at)
        self._skill_ended = False
        first, *further_values = sensed.values
        self._options = (
            Option(first[0], weight=first[1]),
            *(Option(text, faults=1, weight=weight) for text, weight in further_values),
        )
        if sensed.after:
            agent.bus.subscribe(self._note, SkillStatus)

    def _note(self, status: Event) -> None:
        if not isinstance(status, SkillStatus):
            return
        name = _SKILL.match(status.skill_string)
        if status.status in _ENDED and name is not None and name.group() in self._sensed.after:
            self._skill_ended = True

    def loop(self) -> None:
        """Choose and write a value if a decision is due."""
        is_due, self._skill_ended = self._skill_ended, False
        while self._at and self._at[0] <= self._ask.seconds:
            del self._at[0]
            is_due = True
        if is_due:
            text = self._ask(ChoiceKind.SENSED, self._subject, self._options).name
            self._set(text)
            self._interface.write()

    def _set(self, text: str) -> None:
        assign(self._interface, [f"{self._sensed.name}={text}"])


class MessageChoices(Listener, Closing):
    """Drops or delays messages to the writer of an interface.

    :param prefix: the prefix of its subjects.
    """

    def __init__(self, message: MessageFault, board: LocalBlackBoard, ask: Asking, prefix: str) -> None:
        self._fault, self._ask, self._prefix, self._board = message, ask, prefix, board
        self._late: list[tuple[float, Message]] = []
        self._passing: Message | None = None
        self._reader: Interface = board.open_for_reading(*parse_uid(message.uid), owner=OWNER)
        self._memory = board.memory_of(self._reader)
        self._memory.listeners.register(self, self._reader, (EventKind.MESSAGE_RECEIVED,))
        faults = [
            fault(name, weight) for name, weight in (("lost", message.lost), ("late", message.late)) if weight
        ]
        self._options = unless("arrives", *faults)

    def message_received(self, interface: Interface, message: Message) -> bool:
        """Return whether a message is delivered now."""
        is_meant = self._fault.type in ("*", message.type, message.type.removesuffix("Message"))
        if message is self._passing or not is_meant:
            return True
        subject = f"{self._prefix}{interface.uid} {message.type}"
        chosen = self._ask(ChoiceKind.MESSAGE, subject, self._options).name
        if chosen == "late":
            self._late.append((self._ask.seconds + self._fault.delay, message))
        return chosen == "arrives"

    def loop(self) -> None:
        """Deliver messages whose delay is over."""
        while self._late and self._late[0][0] <= self._ask.seconds:
            self._passing = self._late.pop(0)[1]
            with suppress(BlackBoardError):  # the writer may have closed the interface
                self._memory.transmit(self._reader, self._passing)
            self._passing = None

    def close(self) -> None:
        """Stop dropping and delaying messages."""
        self._board.close(self._reader)
