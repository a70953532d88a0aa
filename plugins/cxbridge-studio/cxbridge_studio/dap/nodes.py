"""The state of a stop as trees of variables: locals, goals, the agenda, facts by template.

Children are made when a client opens a node: an agent has thousands of facts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge.clipstext.values import FactRef, Symbol, Value, show, show_alone
from cxbridge.errors import CxbridgeError
from cxbridge.events import FactChange
from cxbridge_studio.dap.expressions import variables_of
from cxbridge_studio.dap.frames import ACTION, GOAL, CallFrame, goals_of, slots_of
from cxbridge_studio.dap.target import StoppedEnvironment

# The limit of the shown activations, and of the shown facts of a deftemplate: a client asks for all at once.
MAX_ROWS: Final = 1000

_TYPES: Final[Mapping[type, str]] = {int: "INTEGER", float: "FLOAT", str: "STRING", Symbol: "SYMBOL"}


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A named value.

    :param kind: the type of the value, such as ``INTEGER`` or a deftemplate's name; may be empty.
    :param children: returns the child nodes; None without children.
    :param change: sets the value from CLIPS text and returns the new value; None for a read-only value.
    :param expression: the expression that evaluates to the value; empty if there is none.
    """

    name: str
    value: str
    kind: str = ""
    children: Callable[[], Sequence[VariableNode]] | None = None
    change: Callable[[str], str] | None = None
    expression: str = ""


@dataclass(frozen=True, slots=True)
class NodeGroup:
    """A scope of a frame.

    :param expensive: whether a client should wait for the user before it opens the scope.
    :param hint: the protocol's presentation hint; may be empty.
    """

    name: str
    children: Callable[[], Sequence[VariableNode]]
    expensive: bool = False
    hint: str = ""


class _TrackedFact:
    """A fact, tracked through changes: each change of a fact gives it another index."""

    def __init__(self, moment: StoppedEnvironment, fact: FactChange) -> None:
        self._moment = moment
        self._original = fact

    @property
    def _current(self) -> FactChange:
        """The latest version of the fact; the original one if a later one is unknown."""
        index = self._original.index
        while index in self._moment.changed:
            index = self._moment.changed[index]
        fact = None if index == self._original.index else self._moment.fact(index)
        return fact or self._original

    def nodes(self) -> list[VariableNode]:
        return [
            VariableNode(name, value, change=partial(self._change, name))
            for name, value in slots_of(self._current).items()
        ]

    def _change(self, slot: str, text: str) -> str:
        index = self._current.index
        self._moment.changed[index] = self._moment.modify(index, slot, text)
        return slots_of(self._current).get(slot, text)


def groups_of(moment: StoppedEnvironment, frame: CallFrame) -> list[NodeGroup]:
    """Return the scopes of a frame."""
    groups: list[NodeGroup] = []
    if frame.kind == "rule":
        groups.append(NodeGroup("Variables", lambda: _variable_nodes(moment), hint="locals"))
    elif frame.fact is not None:
        groups.append(NodeGroup("Slots", _TrackedFact(moment, frame.fact).nodes, hint="locals"))
        if frame.kind == GOAL:
            groups.append(NodeGroup("Plan", partial(_plan_nodes, moment, slots_of(frame.fact).get("id", ""))))
    groups.append(NodeGroup("Goals", lambda: _goal_nodes(moment)))
    if moment.agenda() is not None:
        groups.append(NodeGroup("Agenda", lambda: _activation_nodes(moment)))
    groups.append(NodeGroup("Facts", lambda: _template_nodes(moment), expensive=True))
    return groups


def fact_node(moment: StoppedEnvironment, fact: FactChange) -> VariableNode:
    """Return the node of a fact, with its slots as children."""
    children = _TrackedFact(moment, fact).nodes if slots_of(fact) else None
    return VariableNode(f"f-{fact.index}", fact.text, fact.template, children)


def _variable_nodes(moment: StoppedEnvironment) -> list[VariableNode]:
    try:
        variables = variables_of(moment)
    except CxbridgeError as error:
        return [VariableNode("(not known)", error.message)]
    return [_variable_node(moment, f"?{name}", value) for name, value in variables.items()]


def _variable_node(moment: StoppedEnvironment, name: str, value: Value) -> VariableNode:
    if isinstance(value, FactRef) and (fact := moment.fact(value.index)) is not None:
        text = f"f-{fact.index} {fact.text}"
        return VariableNode(name, text, fact.template, _TrackedFact(moment, fact).nodes, None, name)
    if isinstance(value, tuple):
        items = [VariableNode(str(number), show(field)) for number, field in enumerate(value, start=1)]
        children = (lambda: items) if items else None
        return VariableNode(name, show_alone(value), "MULTIFIELD", children, None, name)
    return VariableNode(name, show_alone(value), _TYPES.get(type(value), ""), None, None, name)


def _goal_nodes(moment: StoppedEnvironment) -> list[VariableNode]:
    facts, forest = goals_of(moment)

    def goal_node(name: str) -> VariableNode:
        slots = slots_of(facts[name])
        state = " ".join(slots.get(slot, "") for slot in ("class", "mode", "outcome"))
        return VariableNode(slots.get("id", ""), state, GOAL, partial(children_of, name))

    def children_of(name: str) -> list[VariableNode]:
        sub_goals = [goal_node(child) for child in forest.children.get(name, ())]
        return [*sub_goals, *_TrackedFact(moment, facts[name]).nodes()]

    return [goal_node(name) for name in forest.roots]


def _plan_nodes(moment: StoppedEnvironment, goal: str) -> list[VariableNode]:
    nodes = []
    for fact in moment.facts(ACTION):
        slots = slots_of(fact)
        if slots.get("goal-id") == goal:
            words = (slots.get("id", ""), slots.get("action-name", ""), slots.get("param-values", ""))
            name = " ".join(filter(None, words))
            nodes.append(VariableNode(name, slots.get("state", ""), ACTION, _TrackedFact(moment, fact).nodes))
    return nodes


def _activation_nodes(moment: StoppedEnvironment) -> list[VariableNode]:
    rows = moment.agenda() or ()
    return [
        VariableNode(f"{number}", f"{salience} {rule}: {basis}", "activation")
        for number, (salience, rule, basis) in enumerate(rows[:MAX_ROWS], start=1)
    ]


def _template_nodes(moment: StoppedEnvironment) -> list[VariableNode]:
    return [
        VariableNode(
            name,
            f"{count} {'fact' if count == 1 else 'facts'}",
            "deftemplate",
            partial(_fact_nodes, moment, name),
        )
        for name, count in sorted(moment.templates().items())
        if count
    ]


def _fact_nodes(moment: StoppedEnvironment, template: str) -> list[VariableNode]:
    facts = moment.facts(template)
    nodes = [fact_node(moment, fact) for fact in facts[:MAX_ROWS]]
    if len(facts) > MAX_ROWS:
        text = f"{len(facts) - MAX_ROWS} more; a pattern in the console finds some"
        nodes.append(VariableNode("...", text))
    return nodes
