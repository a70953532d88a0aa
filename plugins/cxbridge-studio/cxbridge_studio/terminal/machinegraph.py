"""Parses the graphs of SkillerDebugInterface: states, transitions, and the steps at which they were taken.

The interface describes a state machine only by a graph. The parser accepts the subset of the dot language
that the Skillers of cxbridge and Fawkes write.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from cxbridge.errors import SkillerError
from cxbridge.numbers import parse_decimal

_TOKEN = re.compile(r'"((?:\\.|[^"\\])*)"|(->|[{}\[\];,=])|([^\s"{}\[\];,=]+)', re.DOTALL)
# fsmgrapher of Fawkes draws end states in this shape: green for success, red for failure
_END_SHAPE = "doubleoctagon"
_END_COLOURS = {"#6fdd6f": "final", "#ff8080": "failed"}


@dataclass(frozen=True, slots=True)
class MachineState:
    """A state of a machine.

    :param node: the unique name in the graph; ``name`` is unique only in its machine.
    :param is_active: whether the machine is in this state.
    :param kind: ``start``, ``final`` (success), ``failed``, ``end`` for any other end state, or empty.
    :param note: the comment in the state's definition.
    """

    name: str
    node: str
    is_active: bool = False
    kind: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class MachineTransition:
    """A transition between two nodes.

    :param label: the condition of the transition.
    :param steps: the numbers of the steps, from 1, at which the transition was taken.
    """

    source: str
    target: str
    label: str = ""
    steps: tuple[int, ...] = ()


@dataclass(slots=True)
class StateMachine:
    """A state machine, or a graph of skill dependencies.

    :param inner: the machines within the states.
    """

    name: str
    states: list[MachineState] = field(default_factory=list)
    transitions: list[MachineTransition] = field(default_factory=list)
    inner: list[StateMachine] = field(default_factory=list)

    def taken_transitions(self) -> list[MachineTransition]:
        """Return the taken transitions in order, with repetitions."""
        steps = [(step, transition) for transition in self.transitions for step in transition.steps]
        return [transition for _, transition in sorted(steps, key=lambda pair: pair[0])]

    def walk(self) -> Iterator[tuple[int, StateMachine]]:
        """Yield this machine and its inner machines, with their depth."""
        yield 0, self
        for machine in self.inner:
            yield from ((depth + 1, inner) for depth, inner in machine.walk())


def parse_graph(text: str) -> StateMachine:
    """Parse a graph.

    :raises SkillerError: if the text is not a graph, or truncated to the 8191 bytes of the field.
    """
    reader = _DotReader(text)
    reader.expect("digraph")
    machine = StateMachine(reader.next_token())
    reader.expect("{")
    reader.parse_body(machine)
    return machine


class _DotReader:
    """Parses one graph, token by token."""

    def __init__(self, text: str) -> None:
        self._tokens = [
            (kind, token.group(kind)) for token in _TOKEN.finditer(text) if (kind := token.lastindex or 0)
        ]
        self._position = 0

    def next_token(self) -> str:
        """Return the next token."""
        if self._position == len(self._tokens):
            raise SkillerError("the graph is cut off", hint="draw it from the skill files, without --connect")
        self._position += 1
        return self._tokens[self._position - 1][1]

    def expect(self, expected_token: str) -> None:
        """Skip a required token.

        :raises SkillerError: if another token is next.
        """
        token = self.next_token()
        if token != expected_token:
            raise SkillerError(
                f"this is not a graph of a state machine: '{token}' where '{expected_token}' should be"
            )

    def _accept(self, mark: str) -> bool:
        """Skip a mark if it is the next token; return whether it was. A mark in quotes is a name."""
        is_next = self._position < len(self._tokens) and self._tokens[self._position] == (2, mark)
        self._position += is_next
        return is_next

    def parse_body(self, machine: StateMachine) -> None:
        """Parse up to the closing brace."""
        while not self._accept("}"):
            if self._accept("{"):  # states of equal rank, only for the layout
                self.parse_body(StateMachine(""))
                continue
            name = self.next_token()
            if name == "subgraph":
                inner = StateMachine(self.next_token())
                self.expect("{")
                self.parse_body(inner)
                machine.inner.append(inner)
            elif self._accept("="):
                self.next_token()
            elif self._accept("->"):
                target = self.next_token()
                machine.transitions.append(_parse_transition(name, target, self._parse_attributes()))
            else:
                self._add_node(machine, name, self._parse_attributes())
            self._accept(";")

    def _add_node(self, machine: StateMachine, name: str, attributes: dict[str, str]) -> None:
        if name == "graph":
            machine.name = _to_one_line(attributes.get("label", machine.name))
        elif name not in ("node", "edge"):  # statements with defaults for all nodes or edges
            machine.states.append(_parse_state(name, attributes))

    def _parse_attributes(self) -> dict[str, str]:
        attributes: dict[str, str] = {}
        if self._accept("["):
            while not self._accept("]"):
                name = self.next_token()
                attributes[name] = self.next_token() if self._accept("=") else ""
                self._accept(",")
        return attributes


def _to_one_line(label: str) -> str:
    """Return a label in one line."""
    text = re.sub(r"\\(?:\n|[nlr])", " ", label)
    return " ".join(re.sub(r"\\(.)", r"\1", text).split())


def _parse_state(node: str, attributes: dict[str, str]) -> MachineState:
    name, _, note = attributes.get("label", node).partition("\\n(")
    kind = "start" if attributes.get("penwidth") == "4.0" else ""  # only the start state has a thick line
    if attributes.get("shape") == _END_SHAPE:
        kind = _END_COLOURS.get(attributes.get("color", ""), "end")
    is_active = attributes.get("active") == "true"
    return MachineState(_to_one_line(name), node, is_active, kind, _to_one_line(note.removesuffix(")")))


def _parse_transition(source: str, target: str, attributes: dict[str, str]) -> MachineTransition:
    numbers = map(parse_decimal, attributes.get("taillabel", "").split(","))
    steps = tuple(number for number in numbers if number is not None)
    return MachineTransition(source, target, _to_one_line(attributes.get("label", "")), steps)
