"""The state of a stop as trees of variables: local variables, goals, the agenda, and facts by deftemplate.

The children of a node are made when the client opens the node, since an agent may have thousands of facts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Final

from cxbridge.clipstext.values import FactRef, Symbol, Value, lone_value_text, value_text
from cxbridge.errors import CxbridgeError
from cxbridge.events import FactChange
from cxbridge.printing import format_count
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.expressions import find_variables
from cxbridge_studio.dap.frames import ACTION, GOAL, CallFrame, find_goals, read_slots
from cxbridge_studio.debugger.agenda import read_activations

# The limit of shown activations, and of shown facts of a deftemplate: a client requests all of them at once.
MAX_ROWS: Final = 1000

# the titles of the scopes that the protocol marks: as local, and as expensive to open
VARIABLES_SCOPE: Final = "Variables"
SLOTS_SCOPE: Final = "Slots"
FACTS_SCOPE: Final = "Facts"

# CLIPS' names of the types of values
_TYPES: Final[Mapping[type, str]] = {int: "INTEGER", float: "FLOAT", str: "STRING", Symbol: "SYMBOL"}


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A named value.

    :param kind: the type of the value, such as ``INTEGER`` or a deftemplate's name; may be empty.
    :param children: a :data:`NodeMaker`; None without children.
    :param set_value: sets the value from CLIPS text and returns the new value; None for a read-only value.
    :param expression: the expression that evaluates to the value; empty if there is none.
    """

    name: str
    value: str
    kind: str = ""
    children: Callable[[], Sequence[VariableNode]] | None = None
    set_value: Callable[[str], str] | None = None
    expression: str = ""


NodeMaker = Callable[[], Sequence[VariableNode]]
"""A function that makes the nodes in a scope or a node, when the client opens it."""


def make_scopes(stopped_env: StoppedEnvironment, frame: CallFrame) -> Mapping[str, NodeMaker]:
    """Return the scopes of a frame: by title, the functions that make their nodes."""
    scopes: dict[str, NodeMaker] = {}
    if frame.kind == "rule":
        scopes[VARIABLES_SCOPE] = partial(_make_variable_nodes, stopped_env)
    elif frame.fact is not None:
        scopes[SLOTS_SCOPE] = partial(_make_slot_nodes, stopped_env, frame.fact)
        if frame.kind == GOAL:
            scopes["Plan"] = partial(_make_plan_nodes, stopped_env, read_slots(frame.fact).get("id", ""))
    return scopes | {
        "Goals": partial(_make_goal_nodes, stopped_env),
        "Agenda": partial(_make_activation_nodes, stopped_env),
        FACTS_SCOPE: partial(_make_template_nodes, stopped_env),
    }


def make_fact_node(stopped_env: StoppedEnvironment, fact: FactChange) -> VariableNode:
    """Return the node of a fact, with its slots as children."""
    children = partial(_make_slot_nodes, stopped_env, fact) if read_slots(fact) else None
    return VariableNode(f"f-{fact.index}", fact.text, fact.template, children)


def _make_slot_nodes(stopped_env: StoppedEnvironment, fact: FactChange) -> list[VariableNode]:
    """Return the slots of the latest version of a fact, which the client can set."""
    return [
        VariableNode(name, value, set_value=partial(_set_slot, stopped_env, fact, name))
        for name, value in read_slots(stopped_env.find_latest(fact)).items()
    ]


def _set_slot(stopped_env: StoppedEnvironment, fact: FactChange, slot: str, text: str) -> str:
    """Set a slot of the latest version of a fact, and return the new value.

    :raises CxbridgeError: if the slot cannot have the value.
    """
    stopped_env.modify(stopped_env.find_latest(fact).index, slot, text)
    return read_slots(stopped_env.find_latest(fact)).get(slot, text)


def _make_variable_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    try:
        variables = find_variables(stopped_env)
    except CxbridgeError as error:
        return [VariableNode("(not known)", error.message)]
    return [_make_variable_node(stopped_env, f"?{name}", value) for name, value in variables.items()]


def _make_variable_node(stopped_env: StoppedEnvironment, name: str, value: Value) -> VariableNode:
    if isinstance(value, FactRef) and (fact := stopped_env.find_fact(value.index)) is not None:
        text = f"f-{fact.index} {fact.text}"
        children = partial(_make_slot_nodes, stopped_env, fact)
        return VariableNode(name, text, fact.template, children, expression=name)
    if isinstance(value, tuple):
        items = [VariableNode(str(number), value_text(field)) for number, field in enumerate(value, start=1)]
        return VariableNode(
            name, lone_value_text(value), "MULTIFIELD", (lambda: items) if items else None, expression=name
        )
    return VariableNode(name, lone_value_text(value), _TYPES.get(type(value), ""), expression=name)


def _make_goal_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    goal_facts, forest = find_goals(stopped_env)

    def make_goal_node(goal_id: str) -> VariableNode:
        slots = read_slots(goal_facts[goal_id])
        state = " ".join(slots.get(slot, "") for slot in ("class", "mode", "outcome"))
        return VariableNode(goal_id, state, GOAL, partial(make_children, goal_id))

    def make_children(goal_id: str) -> list[VariableNode]:
        sub_goal_nodes = [make_goal_node(child_id) for child_id in forest.children.get(goal_id, ())]
        return [*sub_goal_nodes, *_make_slot_nodes(stopped_env, goal_facts[goal_id])]

    return [make_goal_node(goal_id) for goal_id in forest.roots]


def _make_plan_nodes(stopped_env: StoppedEnvironment, goal_id: str) -> list[VariableNode]:
    """Return the plan-actions of a goal, each with its id, name and arguments as the title."""
    return [
        VariableNode(
            " ".join(filter(None, map(slots.get, ("id", "action-name", "param-values")))),
            slots.get("state", ""),
            ACTION,
            partial(_make_slot_nodes, stopped_env, fact),
        )
        for fact in stopped_env.read_facts(ACTION)
        if (slots := read_slots(fact)).get("goal-id") == goal_id
    ]


def _make_activation_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    activations = islice(read_activations(stopped_env.env), MAX_ROWS)
    return [
        VariableNode(f"{number}", f"{salience} {rule}: {basis}", "activation")
        for number, (salience, rule, basis) in enumerate(activations, start=1)
    ]


def _make_template_nodes(stopped_env: StoppedEnvironment) -> list[VariableNode]:
    return [
        VariableNode(
            name, format_count(count, "fact"), "deftemplate", partial(_make_fact_nodes, stopped_env, name)
        )
        for name, count in sorted(Counter(name for _, name, _ in stopped_env.env.facts()).items())
    ]


def _make_fact_nodes(stopped_env: StoppedEnvironment, template: str) -> list[VariableNode]:
    facts = stopped_env.read_facts(template)
    nodes = [make_fact_node(stopped_env, fact) for fact in facts[:MAX_ROWS]]
    if len(facts) > MAX_ROWS:
        text = f"{len(facts) - MAX_ROWS} more; a pattern in the console can select them"
        nodes.append(VariableNode("...", text))
    return nodes
