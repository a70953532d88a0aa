"""The state of a stop as trees of variables: locals, goals, the agenda, facts by template."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge.clipstext.values import FactRef, Symbol, Value, show, show_alone
from cxbridge.errors import CxbridgeError
from cxbridge.events import FactChange
from cxbridge.history.forest import Forest, parent_id
from cxbridge_studio.dap.expressions import variables_of
from cxbridge_studio.dap.frames import ACTION, GOAL, CallFrame, slots_of
from cxbridge_studio.dap.target import StoppedEnvironment

MAX_ROWS: Final = 1000  # limit of shown activations, and of shown facts of a deftemplate

_TYPES: Final[Mapping[type, str]] = {int: "INTEGER", float: "FLOAT", str: "STRING", Symbol: "SYMBOL"}


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A named value.

    :param children: returns the child nodes; None without children.
    :param change: sets the value from CLIPS text and returns the new value; None for a read-only value.
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

    :param expensive: whether a client should not open the scope automatically.
    """

    name: str
    children: Callable[[], Sequence[VariableNode]]
    expensive: bool = False
    hint: str = ""


class _Fact:
    """A fact, tracked through changes: each change of a fact gives it another index."""

    def __init__(self, moment: StoppedEnvironment, fact: FactChange) -> None:
        self._moment = moment
        self._first = fact

    @property
    def _now(self) -> FactChange:
        index = self._first.index
        while index in self._moment.changed:
            index = self._moment.changed[index]
        fact = self._first if index == self._first.index else self._moment.fact(index)
        return fact or self._first

    def nodes(self) -> list[VariableNode]:
        return [
            VariableNode(name, value, change=partial(self._change, name))
            for name, value in slots_of(self._now).items()
        ]

    def _change(self, slot: str, text: str) -> str:
        old_index = self._now.index
        self._moment.changed[old_index] = self._moment.modify(old_index, slot, text)
        return slots_of(self._now).get(slot, text)


def groups_of(moment: StoppedEnvironment, frame: CallFrame) -> list[NodeGroup]:
    groups: list[NodeGroup] = []
    if frame.kind == "rule":
        groups.append(NodeGroup("Variables", lambda: _variables(moment), hint="locals"))
    elif frame.fact is not None:
        groups.append(NodeGroup("Slots", _Fact(moment, frame.fact).nodes, hint="locals"))
        if frame.kind == GOAL:
            groups.append(NodeGroup("Plan", partial(_plan, moment, slots_of(frame.fact).get("id", ""))))
    groups.append(NodeGroup("Goals", lambda: _goals(moment)))
    if moment.agenda() is not None:
        groups.append(NodeGroup("Agenda", lambda: _agenda(moment)))
    groups.append(NodeGroup("Facts", lambda: _templates(moment), expensive=True))
    return groups


def fact_node(moment: StoppedEnvironment, fact: FactChange) -> VariableNode:
    """Return the node of a fact, with its slots as children."""
    changeable = _Fact(moment, fact)
    return VariableNode(
        f"f-{fact.index}", fact.text, fact.template, changeable.nodes if slots_of(fact) else None
    )


def _variables(moment: StoppedEnvironment) -> list[VariableNode]:
    try:
        known = variables_of(moment)
    except CxbridgeError as error:
        return [VariableNode("(not known)", error.message)]
    return [_variable(moment, name, value) for name, value in known.items()]


def _variable(moment: StoppedEnvironment, name: str, value: Value) -> VariableNode:
    text, shown = f"?{name}", show_alone(value)
    if isinstance(value, FactRef):
        fact = moment.fact(value.index)
        if fact is not None:
            return VariableNode(
                text, f"f-{fact.index} {fact.text}", fact.template, _Fact(moment, fact).nodes, None, text
            )
    if isinstance(value, tuple):
        items = [VariableNode(str(number), show(each)) for number, each in enumerate(value, start=1)]
        return VariableNode(text, shown, "MULTIFIELD", (lambda: items) if items else None, None, text)
    return VariableNode(text, shown, _TYPES.get(type(value), ""), None, None, text)


def _goals(moment: StoppedEnvironment) -> list[VariableNode]:
    facts = {slots_of(fact).get("id", ""): fact for fact in moment.facts(GOAL)}
    forest = Forest({name: parent_id(slots_of(fact).get("parent", "")) for name, fact in facts.items()})

    def made(names: Iterable[str]) -> list[VariableNode]:
        return [_goal(moment, facts[name], partial(below, name)) for name in names]

    def below(name: str) -> list[VariableNode]:
        return made(forest.children.get(name, ()))

    return made(forest.roots)


def _goal(
    moment: StoppedEnvironment, fact: FactChange, below: Callable[[], list[VariableNode]]
) -> VariableNode:
    slots = slots_of(fact)
    state = " ".join(slots.get(slot, "") for slot in ("class", "mode", "outcome"))
    return VariableNode(slots.get("id", ""), state, GOAL, lambda: [*below(), *_Fact(moment, fact).nodes()])


def _plan(moment: StoppedEnvironment, goal: str) -> list[VariableNode]:
    actions = [fact for fact in moment.facts(ACTION) if slots_of(fact).get("goal-id") == goal]
    nodes = []
    for fact in actions:
        slots = slots_of(fact)
        name = " ".join(filter(None, (slots.get("action-name", ""), slots.get("param-values", ""))))
        nodes.append(
            VariableNode(
                f"{slots.get('id', '')} {name}", slots.get("state", ""), ACTION, _Fact(moment, fact).nodes
            )
        )
    return nodes


def _agenda(moment: StoppedEnvironment) -> list[VariableNode]:
    rows = moment.agenda() or ()
    return [
        VariableNode(f"{number}", f"{salience} {rule}: {basis}", "activation")
        for number, (salience, rule, basis) in enumerate(rows[:MAX_ROWS], start=1)
    ]


def _templates(moment: StoppedEnvironment) -> list[VariableNode]:
    return [
        VariableNode(
            name,
            f"{count} {'fact' if count == 1 else 'facts'}",
            "deftemplate",
            partial(_facts, moment, name),
        )
        for name, count in sorted(moment.templates().items())
        if count
    ]


def _facts(moment: StoppedEnvironment, template: str) -> list[VariableNode]:
    facts = moment.facts(template)
    shown = [fact_node(moment, fact) for fact in facts[:MAX_ROWS]]
    if len(facts) > MAX_ROWS:
        shown.append(
            VariableNode("...", f"{len(facts) - MAX_ROWS} more; a pattern in the console finds some")
        )
    return shown
