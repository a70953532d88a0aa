"""The services of the domain expert."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    And,
    Domain,
    Formula,
    Function,
    Predicate,
    Timed,
    TypedList,
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.printer import format_domain
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.answers import ExpertService
from cxbridge_ros2.experts.knowledge import ProblemExpert, subtypes
from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind, param
from cxbridge_ros2.messages import Message

_TIMES: Final = {
    "at_start_requirements": ("at start", "condition"),
    "over_all_requirements": ("over all", "condition"),
    "at_end_requirements": ("at end", "condition"),
    "at_start_effects": ("at start", "effect"),
    "at_end_effects": ("at end", "effect"),
}


def _text(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    return {"domain": format_domain(expert.domain)}


def _name(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    return {"name": expert.domain.name}


def _types(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    names = dict.fromkeys(names_of(expert.domain.types))
    return {"types": [name for name in names if name != ROOT_TYPE]}


def _constants(expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    domain, type_name = expert.domain, request["type"]
    _find(type_name, (ROOT_TYPE, *names_of(domain.types)), "type")
    return {
        "constants": [name for name, kind in pairs_of(domain.constants) if (kind or ROOT_TYPE) == type_name]
    }


def _actions(
    expert: ProblemExpert, _codec: NodeCodec, _request: Message, *, durative: bool
) -> Mapping[str, Any]:
    return {"actions": [each.name for each in expert.domain.actions if each.durative is durative]}


def _action(expert: ProblemExpert, codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    domain = expert.domain
    action = _action_of(domain, request["action"], durative=False)
    parameters, names = _parameters(domain, action, request["parameters"])
    tree = partial(codec.tree, names=names, types_of=partial(_types_of, domain))
    return {
        "action": {
            "name": request["action"],
            "parameters": parameters,
            "preconditions": tree(action.condition),
            "effects": tree(action.effect),
        }
    }


def _durative_action(expert: ProblemExpert, codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    domain, name = expert.domain, request["durative_action"]
    action = _action_of(domain, name, durative=True)
    parameters, names = _parameters(domain, action, request["parameters"])
    tree = partial(codec.tree, names=names, types_of=partial(_types_of, domain))
    parts = {"condition": action.condition, "effect": action.effect}
    trees = {field: tree(_at(when, parts[part])) for field, (when, part) in _TIMES.items()}
    return {"durative_action": {"name": name, "parameters": parameters, **trees}}


def _at(when: str, formula: Formula | None) -> Formula:
    """Return the part of a formula for a time; an empty conjunction if there is none, as in PlanSys2."""
    parts = formula.parts if isinstance(formula, And) else (formula,)
    timed_parts = tuple(each.part for each in parts if isinstance(each, Timed) and each.when == when)
    return And(timed_parts)


def _declared(
    expert: ProblemExpert, _codec: NodeCodec, _request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    return {"states": [{"node_type": int(kind), "name": each.name} for each in _of(expert.domain, kind)]}


def _details(
    expert: ProblemExpert, _codec: NodeCodec, request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    domain, noun = expert.domain, kind.name.lower()
    known = {each.name: each for each in _of(domain, kind)}
    declaration = known[_find(request["expression"], known, noun)]
    types = _each_type(declaration.parameters)
    parameters = [param(f"?{each}{index}", each, subtypes(domain, each)) for index, each in enumerate(types)]
    return {"node": {"node_type": int(kind), "name": declaration.name, "parameters": parameters}}


def _derived(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    assert expert.domain  # there are none here, but a missing domain is an error
    return {"states": []}


def _derived_details(_expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    raise Ros2Error(f"'{request['predicate']}': there are no derived predicates here")


def _of(domain: Domain, kind: TreeNodeKind) -> Sequence[Predicate | Function]:
    return domain.predicates if kind is TreeNodeKind.PREDICATE else domain.functions


def _types_of(domain: Domain, name: str) -> tuple[str, ...]:
    for kind in (TreeNodeKind.PREDICATE, TreeNodeKind.FUNCTION):
        for each in _of(domain, kind):
            if each.name == name:
                return tuple(_each_type(each.parameters))
    return ()


def _each_type(parameters: TypedList) -> list[str]:
    return [group.types[0] if group.types else ROOT_TYPE for group in parameters for _ in group.names]


def _parameters(
    domain: Domain, action: ActionSchema, parameter_names: Sequence[str]
) -> tuple[list[Message], dict[str, str]]:
    """Return an action's parameters, and the values of its variables."""
    names = names_of(action.parameters)
    called = [
        parameter_names[index] if index < len(parameter_names) else f"?{index}" for index in range(len(names))
    ]
    types = _each_type(action.parameters)
    parameters = [param(name, kind, subtypes(domain, kind)) for name, kind in zip(called, types, strict=True)]
    return parameters, dict(zip(names, called, strict=True))


def _action_of(domain: Domain, name: str, *, durative: bool) -> ActionSchema:
    known = {each.name: each for each in domain.actions if each.durative is durative}
    return known[_find(name, known, "durative action" if durative else "action")]


def _find(name: str, names: Iterable[str], noun: str) -> str:
    """Return the matching name, ignoring case if necessary."""
    known = [*names]
    matching = [each for each in known if each == name] or [
        each for each in known if each.lower() == name.lower()
    ]
    if not matching:
        raise Ros2Error(f"the domain has no {noun} '{name}'", hint=did_you_mean(name, known))
    return matching[0]


# Services of the domain expert, by the last part of the name.
DOMAIN_SERVICES: Final[Mapping[str, ExpertService]] = {
    "get_domain": ExpertService(_text),
    "get_domain_name": ExpertService(_name),
    "get_domain_types": ExpertService(_types),
    "get_domain_constants": ExpertService(_constants, "Type not found"),
    "get_domain_actions": ExpertService(partial(_actions, durative=False)),
    "get_domain_action_details": ExpertService(_action, "Action not found"),
    "get_domain_durative_actions": ExpertService(partial(_actions, durative=True)),
    "get_domain_durative_action_details": ExpertService(_durative_action, "Durative action not found"),
    "get_domain_predicates": ExpertService(partial(_declared, kind=TreeNodeKind.PREDICATE)),
    "get_domain_predicate_details": ExpertService(
        partial(_details, kind=TreeNodeKind.PREDICATE), "Predicate not found"
    ),
    "get_domain_functions": ExpertService(partial(_declared, kind=TreeNodeKind.FUNCTION)),
    "get_domain_function_details": ExpertService(
        partial(_details, kind=TreeNodeKind.FUNCTION), "Function not found"
    ),
    "get_domain_derived_predicates": ExpertService(_derived),
    "get_domain_derived_predicate_details": ExpertService(_derived_details, "Derived predicate not found"),
}
