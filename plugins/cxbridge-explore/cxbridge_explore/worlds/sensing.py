"""Choices about the inputs of an agent: sensed values, and messages that are lost."""

from __future__ import annotations

import re
from typing import Final

from cxbridge.blackboard import LocalBlackBoard, parse_uid
from cxbridge.blackboard.listeners import EventKind, Listener
from cxbridge.closing import Closing
from cxbridge.errors import InterfaceError
from cxbridge.events import Event, SkillStatus
from cxbridge.interfaces.assignments import assign
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message
from cxbridge.run.agent import Run
from cxbridge_explore.worldmodel.model import MessageLoss, SensedField
from cxbridge_explore.worlds.points import ChoiceKind, Option, RunChoices, make_fault, make_options

_SKILL_NAME: Final = re.compile(r"\w+")
OWNER: Final = "world"  # owner of the interfaces that the world opens

_END_STATUSES: Final = ("S_FINAL", "S_FAILED")


class SensedChoices:
    """Writes chosen values to a field of an interface.

    :param interface: the interface, open for writing.
    :param prefix: precedes the subject of each choice, e.g. ``robot1/``.
    :raises ConfigError: if a value does not fit the field.
    """

    def __init__(
        self, sensed: SensedField, agent: Run, interface: Interface, choices: RunChoices, prefix: str
    ) -> None:
        self._sensed, self._interface, self._choices = sensed, interface, choices
        # Setting a value checks the value. In reversed order, the usual value is set last, and stays.
        for text, _ in reversed(sensed.weighted_values):
            try:
                self._set_field(text)
            except InterfaceError as error:
                raise sensed.mark.error(error.message, error.hint) from None
        self._subject = f"{prefix}{sensed.uid}.{sensed.field_name}"
        self._times_s = list(sensed.times_s)
        self._has_skill_ended = False
        # the first value is the usual value, and each further value is a fault
        self._options = tuple(
            Option(text, faults=int(number > 0), weight=weight)
            for number, (text, weight) in enumerate(sensed.weighted_values)
        )
        if sensed.skills:
            agent.bus.subscribe(self._record_skill_end, SkillStatus)

    def _record_skill_end(self, event: Event) -> None:
        assert isinstance(event, SkillStatus)
        name_match = _SKILL_NAME.match(event.skill_string)
        if (
            event.status in _END_STATUSES
            and name_match is not None
            and name_match.group() in self._sensed.skills
        ):
            self._has_skill_ended = True

    def apply(self) -> None:
        """Choose and write a value if a decision is due."""
        is_due, self._has_skill_ended = self._has_skill_ended, False
        while self._times_s and self._times_s[0] <= self._choices.seconds:
            del self._times_s[0]
            is_due = True
        if is_due:
            self._set_field(self._choices.choose(ChoiceKind.SENSED, self._subject, self._options).name)
            self._interface.write()

    def _set_field(self, text: str) -> None:
        assign(self._interface, [f"{self._sensed.field_name}={text}"])


class MessageChoices(Listener, Closing):
    """Decides which messages to the writer of an interface are lost.

    :param prefix: precedes the subject of each choice, e.g. ``robot1/``.
    """

    def __init__(self, loss: MessageLoss, board: LocalBlackBoard, choices: RunChoices, prefix: str) -> None:
        self._loss, self._choices, self._prefix, self._board = loss, choices, prefix, board
        self._reader: Interface = board.open_for_reading(*parse_uid(loss.uid), owner=OWNER)
        listeners = board.find_memory(self._reader).listeners
        listeners.register(self, self._reader, (EventKind.MESSAGE_RECEIVED,))
        self._options = make_options("arrives", make_fault("lost", loss.probability))

    def message_received(self, interface: Interface, message: Message) -> bool:
        """Return whether a message is delivered."""
        if self._loss.message_type not in ("*", message.type, message.type.removesuffix("Message")):
            return True
        subject = f"{self._prefix}{interface.uid} {message.type}"
        return self._choices.choose(ChoiceKind.MESSAGE, subject, self._options).name == "arrives"

    def close(self) -> None:
        """Stop dropping messages."""
        self._board.close(self._reader)
