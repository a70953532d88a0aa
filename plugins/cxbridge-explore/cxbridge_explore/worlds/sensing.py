"""Choices about the inputs of an agent: sensed values, and messages that are lost or late."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Final

from cxbridge.blackboard import LocalBlackBoard, parse_uid
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import EventKind, Listener
from cxbridge.closing import Closing
from cxbridge.errors import InterfaceError
from cxbridge.events import Event, SkillStatus
from cxbridge.interfaces.assignments import assign
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message
from cxbridge.run.agent import Run
from cxbridge_explore.worldmodel.model import MessageFault, SensedValue
from cxbridge_explore.worlds.points import ChoiceKind, Option, RunChoices, fault, with_faults

_SKILL: Final = re.compile(r"\w+")
OWNER: Final = "world"  # owner of the interfaces that the world opens

_ENDED: Final = ("S_FINAL", "S_FAILED")


class SensedChoices:
    """Writes chosen values to a field of an interface.

    :param interface: the interface, open for writing.
    :param prefix: starts the subject of each choice, e.g. ``robot1/``.
    :raises ConfigError: if a value does not fit the field.
    """

    def __init__(
        self, sensed: SensedValue, agent: Run, interface: Interface, choices: RunChoices, prefix: str
    ) -> None:
        self._sensed, self._interface, self._choices = sensed, interface, choices
        # Setting a value checks it. In reversed order, the usual value is in the field afterwards.
        for text, _ in reversed(sensed.values):
            try:
                self._set(text)
            except InterfaceError as error:
                raise sensed.mark.error(error.message, error.hint) from None
        self._subject = f"{prefix}{sensed.uid}.{sensed.name}"
        self._times = list(sensed.at)
        self._skill_ended = False
        self._options = tuple(
            Option(text, faults=int(number > 0), weight=weight)
            for number, (text, weight) in enumerate(sensed.values)
        )
        if sensed.after:
            agent.bus.subscribe(self._note_skill, SkillStatus)

    def _note_skill(self, event: Event) -> None:
        assert isinstance(event, SkillStatus)
        name = _SKILL.match(event.skill_string)
        if event.status in _ENDED and name is not None and name.group() in self._sensed.after:
            self._skill_ended = True

    def apply(self) -> None:
        """Choose and write a value if a decision is due."""
        is_due, self._skill_ended = self._skill_ended, False
        while self._times and self._times[0] <= self._choices.seconds:
            del self._times[0]
            is_due = True
        if is_due:
            self._set(self._choices.choose(ChoiceKind.SENSED, self._subject, self._options).name)
            self._interface.write()

    def _set(self, text: str) -> None:
        assign(self._interface, [f"{self._sensed.name}={text}"])


class MessageChoices(Listener, Closing):
    """Drops or delays messages to the writer of an interface.

    :param prefix: starts the subject of each choice, e.g. ``robot1/``.
    """

    def __init__(
        self, message: MessageFault, board: LocalBlackBoard, choices: RunChoices, prefix: str
    ) -> None:
        self._fault, self._choices, self._prefix, self._board = message, choices, prefix, board
        self._late: list[tuple[float, Message]] = []  # seconds of the delivery, and the message
        self._delivered: Message | None = None  # the late message during its delivery
        self._reader: Interface = board.open_for_reading(*parse_uid(message.uid), owner=OWNER)
        self._memory = board.find_memory(self._reader)
        self._memory.listeners.register(self, self._reader, (EventKind.MESSAGE_RECEIVED,))
        faults = (("lost", message.lost), ("late", message.late))
        self._options = with_faults("arrives", *(fault(name, weight) for name, weight in faults if weight))

    def message_received(self, interface: Interface, message: Message) -> bool:
        """Return whether a message is delivered now."""
        has_type = self._fault.type in ("*", message.type, message.type.removesuffix("Message"))
        # The delivery of a late message passes this listener again, and must not be delayed again.
        if message is self._delivered or not has_type:
            return True
        subject = f"{self._prefix}{interface.uid} {message.type}"
        chosen = self._choices.choose(ChoiceKind.MESSAGE, subject, self._options).name
        if chosen == "late":
            self._late.append((self._choices.seconds + self._fault.delay, message))
        return chosen == "arrives"

    def apply(self) -> None:
        """Deliver messages whose delay is over."""
        while self._late and self._late[0][0] <= self._choices.seconds:
            self._delivered = self._late.pop(0)[1]
            with suppress(BlackBoardError):  # the writer may have closed the interface
                self._memory.transmit(self._reader, self._delivered)
            self._delivered = None

    def close(self) -> None:
        """Stop dropping and delaying messages."""
        self._board.close(self._reader)
