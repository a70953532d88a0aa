"""Access of a test to the facts of an agent, and to interfaces and messages on its blackboard."""

from __future__ import annotations

from typing import Any

from cxbridge.blackboard import BlackBoard, parse_uid
from cxbridge.errors import ClipsError
from cxbridge.executive.host.constructs import construct_names
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Value
from cxbridge.interfaces.assignments import set_field
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance import Interface
from cxbridge.suggestions import bracketed_suggestion

OWNER = "test"
"""The owner of interfaces that a test opens."""


class World:
    """The facts of an agent's environment, and the interfaces of its blackboard; a base of runs in tests."""

    def __init__(self, env: ClipsEnvironment, board: BlackBoard) -> None:
        self._env, self._board = env, board
        self._writers: dict[str, Interface] = {}
        self._readers: dict[str, Interface] = {}

    def facts(self, template: str, **slots: object) -> list[dict[str, Value]]:
        """Return the facts of a deftemplate with these slot values; ``_`` in names also means ``-``.

        :raises AssertionError: if there is no such deftemplate, or its facts have no such slot.
        """
        with self._env.lock:
            return [fact for _, fact in self._find_facts(template, slots)]

    def fact(self, template: str, **slots: object) -> dict[str, Value]:
        """Return the only matching fact.

        :raises AssertionError: if no fact or several facts match, or as :meth:`facts`.
        """
        facts = self.facts(template, **slots)
        if len(facts) != 1:
            pattern = " ".join([template, *(f"({name} {value})" for name, value in slots.items())])
            raise AssertionError(f"{len(facts)} facts match ({pattern}), not one")
        return facts[0]

    def _find_facts(self, template: str, slots: dict[str, object]) -> list[tuple[int, dict[str, Value]]]:
        """Return index and slots of the facts with these slot values."""
        if not self._env.has_template(template):
            template = template.replace("_", "-")
        if not self._env.has_template(template):
            suggestion = bracketed_suggestion(template, construct_names(self._env, "deftemplate"))
            raise AssertionError(f"there is no deftemplate '{template}'{suggestion}")
        # names of keyword arguments cannot have a dash, while names of slots may have dashes or underscores
        expected_values = {name.replace("_", "-"): _to_comparable(value) for name, value in slots.items()}
        matching_facts = []
        for index, _, fact in self._env.facts(template):
            slot_names = {name: name if name in fact else name.replace("-", "_") for name in expected_values}
            unknown_names = [name for name, slot in slot_names.items() if slot not in fact]
            if unknown_names:
                raise AssertionError(
                    f"deftemplate '{template}' has no slot '{unknown_names[0]}'; it has: {', '.join(fact)}"
                )
            if all(
                _to_comparable(fact[slot_names[name]]) == value for name, value in expected_values.items()
            ):
                matching_facts.append((index, fact))
        return matching_facts

    def assert_fact(self, text: str) -> None:
        """Assert a fact written as CLIPS text, e.g. ``(door (state open))``.

        :raises AssertionError: if CLIPS refuses the text.
        """
        with self._env.lock:
            fault_count = len(self._env.faults)
            try:
                self._env.eval(f"(assert {text})")
            except ClipsError as error:
                if len(self._env.faults) == fault_count:  # the run reports faults of Python code
                    reason = error.message.removeprefix(f"CLIPS cannot evaluate (assert {text}): ")
                    raise AssertionError(f"{text} cannot be asserted: {reason}") from None

    def retract(self, template: str, **slots: object) -> int:
        """Retract the matching facts; return their number.

        :raises AssertionError: as :meth:`facts`.
        """
        with self._env.lock:
            return sum(self._env.retract(index) for index, _ in self._find_facts(template, slots))

    def write(self, uid: str, **fields: object) -> None:
        """Write an interface, and remain its writer.

        :param uid: the type and id of the interface, ``TYPE::ID``.
        :raises CxbridgeError: if there is no such interface or field, or the interface has another writer.
        """
        if uid not in self._writers:
            self._writers[uid] = self._board.open_for_writing(*parse_uid(uid), owner=OWNER)
        interface = self._writers[uid]
        _set_fields(interface, fields)
        interface.write()

    def send(self, uid: str, message: str, **fields: object) -> int:
        """Send a message to an interface's writer; return the id of the message.

        :param message: the type of the message, with or without ``Message`` at the end.
        :raises CxbridgeError: if there is no such interface, message or field, or no writer.
        """
        interface = self._open_reader(uid)
        outgoing = interface.create_message(message if message.endswith("Message") else f"{message}Message")
        _set_fields(outgoing, fields)
        return interface.msgq_enqueue(outgoing)

    def read(self, uid: str) -> dict[str, Any]:
        """Return the values of an interface's fields.

        :raises CxbridgeError: if there is no such interface.
        """
        interface = self._open_reader(uid)
        interface.read()
        return interface.as_dict()

    def _open_reader(self, uid: str) -> Interface:
        """Return the instance for reading an interface; the first call opens the instance."""
        if uid not in self._readers:
            self._readers[uid] = self._board.open_for_reading(*parse_uid(uid), owner=OWNER)
        return self._readers[uid]

    def _close_interfaces(self) -> None:
        for interface in (*self._writers.values(), *self._readers.values()):
            self._board.close(interface)


def _set_fields(block: Block, fields: dict[str, object]) -> None:
    for name, value in fields.items():
        set_field(block, name, value)


def _to_comparable(value: object) -> object:
    """Return a value in a form that is equal for equal values of CLIPS and Python."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, str):
        return str(value)  # symbols and strings of CLIPS are equal in tests
    if isinstance(value, (tuple, list)):
        return tuple(_to_comparable(item) for item in value)
    return value
