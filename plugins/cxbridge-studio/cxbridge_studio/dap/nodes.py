"""The state of a stop as trees of variables: local variables, goals, the agenda, and facts by deftemplate.

The children of a node are made when the client opens the node, since an agent may have thousands of facts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge.clipstext.values import FactRef, Symbol, Value, show, show_alone
from cxbridge.errors import CxbridgeError
from cxbridge.events import FactChange
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.expressions import find_variables
from cxbridge_studio.dap.frames import ACTION, GOAL, CallFrame, find_goals, read_slots

# The limit of shown activations, and of shown facts of a deftemplate: a client requests all of them at once.
MAX_ROWS: Final = 1000

_TYPES: Final[Mapping[type, str]] = {int: "INTEGER", float: "FLOAT", str: "STRING", Symbol: "SYMBOL"}


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A named value.

    :param kind: the type of the value, such as ``INTEGER`` or a deftemplate's name; may be empty.
    :param children: returns the child nodes; None without children.
    :param set_value: sets the value from CLIPS text and returns the new value; None for a read-only value.
    :param expression: the expression that evaluates to the value; empty if there is none.
    """

    name: str
    value: str
    kind: str = ""
    children: Callable[[], Sequence[VariableNode]] | None = None
    set_value: Callable[[str], str] | None = None
    expression: str = ""


@dataclass(frozen=True, slots=True)
class VariableScope:
    """A scope of a frame.

    :param expensive: whether a client should wait for the user before it opens the scope.
    :param hint: the protocol's presentation hint; may be empty.
    """

    name: str
    children: Callable[[], Sequence[VariableNode]]
    expensive: bool = False
    hint: str = ""


class _TrackedFact:
    """A fact and its later versions: each change of a fact makes a new fact with another index."""

    def __init__(self, stopped_env: StoppedEnvironment, fact: FactChange) -> None:
        self._stopped_env = stopped_env
        self._first_version = fact

    @property
    def _current(self) -> FactChange:
        """The latest version of the fact; the first version if no later version is known."""
        index = self._first_version.index
        while index in self._stopped_env.changed_indices:
            index = self._stopped_env.changed_indices[index]
        fact = None if index == self._first_version.index else self._stopped_env.find_fact(index)
        return fact or self._first_version

    def nodes(self) -> list[VariableNode]:
        return [
            VariableNode(name, value, set_value=partial(self._set_slot, name))
            for name, value in read_slots(self._current).items()
        ]

    def _set_slot(self, slot: str, text: str) -> str:
        index = self._current.index
        self._stopped_env.changed_indices[index] = self._stopped_env.modify(index, slot, text)
        return read_slots(self._current).get(slot, text)


def make_scopes(stopped_env: StoppedEnvironment, frame: CallFrame) -> list[VariableScope]:
    """Return the scopes of a frame."""
    scopes: list[VariableScope] = []
    if frame.kind == "rule":
        scopes.append(VariableScope("Variables", lambda: _make_variable_nodes(stopped_env), hint="locals"))
    elif frame.fact is not None:
        scopes.append(VariableScope("Slots", _TrackedFact(stopped_env, frame.fact).nodes, hint="locals"))
        if frame.kind == GOAL:
            scopes.append(
                VariableScope(
                    "Plan", partial(_make_plan_nodes, stopped_env, read_slots(frame.fact).get("id", ""))
                )
            )
    scopes.append(VariableScope("Goals", lambda: _make_goal_nodes(stopped_env)))
    scopes.append(VariableScope("Agenda", lambda: _make_activation_nodes(stopped_env)))
    scopes.append(VariableScope("Facts", lambda: _make_template_nodes(stopped_env), expensive=True))
    return scopes


def make_fact_node(stopped_env: StoppedEnvironment, fact: FactChange) -> VariableNode:
    """Return the node of a fact, with its slots as children."""
    children = _TrackedFact(stopped_env, fact).nodes if read_slots(fact) else None
    return VariableNode(f"f-{fact.index}", fact.text, fact.template, children)


def _make_variable_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    try:
        variables = find_variables(stopped_env)
    except CxbridgeError as error:
        return [VariableNode("(not known)", error.message)]
    return [_make_variable_node(stopped_env, f"?{name}", value) for name, value in variables.items()]


def _make_variable_node(stopped_env: StoppedEnvironment, name: str, value: Value) -> VariableNode:
    if isinstance(value, FactRef) and (fact := stopped_env.find_fact(value.index)) is not None:
        text = f"f-{fact.index} {fact.text}"
        return VariableNode(name, text, fact.template, _TrackedFact(stopped_env, fact).nodes, None, name)
    if isinstance(value, tuple):
        items = [VariableNode(str(number), show(field)) for number, field in enumerate(value, start=1)]
        children = (lambda: items) if items else None
        return VariableNode(name, show_alone(value), "MULTIFIELD", children, None, name)
    return VariableNode(name, show_alone(value), _TYPES.get(type(value), ""), None, None, name)


def _make_goal_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    facts, forest = find_goals(stopped_env)

    def make_goal_node(name: str) -> VariableNode:
        slots = read_slots(facts[name])
        state = " ".join(slots.get(slot, "") for slot in ("class", "mode", "outcome"))
        return VariableNode(slots.get("id", ""), state, GOAL, partial(make_children, name))

    def make_children(name: str) -> list[VariableNode]:
        sub_goals = [make_goal_node(child) for child in forest.children.get(name, ())]
        return [*sub_goals, *_TrackedFact(stopped_env, facts[name]).nodes()]

    return [make_goal_node(name) for name in forest.roots]


def _make_plan_nodes(stopped_env: StoppedEnvironment, goal: str) -> list[VariableNode]:
    nodes = []
    for fact in stopped_env.read_facts(ACTION):
        slots = read_slots(fact)
        if slots.get("goal-id") == goal:
            words = (slots.get("id", ""), slots.get("action-name", ""), slots.get("param-values", ""))
            name = " ".join(filter(None, words))
            nodes.append(
                VariableNode(name, slots.get("state", ""), ACTION, _TrackedFact(stopped_env, fact).nodes)
            )
    return nodes


def _make_activation_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    rows = stopped_env.read_agenda()[:MAX_ROWS]
    return [
        VariableNode(f"{number}", f"{salience} {rule}: {basis}", "activation")
        for number, (salience, rule, basis) in enumerate(rows, start=1)
    ]


def _make_template_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    return [
        VariableNode(
            name,
            f"{count} {'fact' if count == 1 else 'facts'}",
            "deftemplate",
            partial(_make_fact_nodes, stopped_env, name),
        )
        for name, count in sorted(stopped_env.count_facts().items())
        if count
    ]


def _make_fact_nodes(stopped_env: StoppedEnvironment, template: str) -> list[VariableNode]:
    facts = stopped_env.read_facts(template)
    nodes = [make_fact_node(stopped_env, fact) for fact in facts[:MAX_ROWS]]
    if len(facts) > MAX_ROWS:
        text = f"{len(facts) - MAX_ROWS} more; a pattern in the console can select them"
        nodes.append(VariableNode("...", text))
    return nodes
