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

# Fields of a DurativeAction: the time point, and the formula of the action.
_TIMES: Final = {
    "at_start_requirements": ("at start", "condition"),
    "over_all_requirements": ("over all", "condition"),
    "at_end_requirements": ("at end", "condition"),
    "at_start_effects": ("at start", "effect"),
    "at_end_effects": ("at end", "effect"),
}


def _domain(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    return {"domain": format_domain(expert.domain)}


def _name(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    return {"name": expert.domain.name}


def _types(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    names = dict.fromkeys(names_of(expert.domain.types))
    return {"types": [name for name in names if name != ROOT_TYPE]}


def _constants(expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    domain, type_name = expert.domain, request["type"]
    _find_name(type_name, (ROOT_TYPE, *names_of(domain.types)), "type")
    return {
        "constants": [name for name, kind in pairs_of(domain.constants) if (kind or ROOT_TYPE) == type_name]
    }


def _actions(
    expert: ProblemExpert, _codec: NodeCodec, _request: Message, *, durative: bool
) -> Mapping[str, Any]:
    return {"actions": [action.name for action in expert.domain.actions if action.durative is durative]}


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
    trees = {
        field: tree(_formulas_at(when, getattr(action, formula))) for field, (when, formula) in _TIMES.items()
    }
    return {"durative_action": {"name": name, "parameters": parameters, **trees}}


def _formulas_at(when: str, formula: Formula | None) -> Formula:
    """Return the formulas for a time point; an empty conjunction if there is none, as in PlanSys2."""
    conjuncts = formula.parts if isinstance(formula, And) else (formula,)
    return And(tuple(timed.part for timed in conjuncts if isinstance(timed, Timed) and timed.when == when))


def _declared(
    expert: ProblemExpert, _codec: NodeCodec, _request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    declarations = _declarations(expert.domain, kind)
    return {"states": [{"node_type": int(kind), "name": declared.name} for declared in declarations]}


def _details(
    expert: ProblemExpert, _codec: NodeCodec, request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    domain, noun = expert.domain, kind.name.lower()
    declarations = {declared.name: declared for declared in _declarations(domain, kind)}
    declaration = declarations[_find_name(request["expression"], declarations, noun)]
    parameters = [
        param(f"?{name}{index}", name, subtypes(domain, name))  # names as in PlanSys2: ?robot0, ?room1
        for index, name in enumerate(_types_in(declaration.parameters))
    ]
    return {"node": {"node_type": int(kind), "name": declaration.name, "parameters": parameters}}


def _derived(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    assert expert.domain  # cxbridge knows no derived predicates, but a missing domain is an error
    return {"states": []}


def _derived_details(_expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    raise Ros2Error(f"'{request['predicate']}': there are no derived predicates here")


def _declarations(domain: Domain, kind: TreeNodeKind) -> Sequence[Predicate | Function]:
    return domain.predicates if kind is TreeNodeKind.PREDICATE else domain.functions


def _types_of(domain: Domain, name: str) -> tuple[str, ...]:
    for kind in (TreeNodeKind.PREDICATE, TreeNodeKind.FUNCTION):
        for declaration in _declarations(domain, kind):
            if declaration.name == name:
                return tuple(_types_in(declaration.parameters))
    return ()


def _types_in(parameters: TypedList) -> list[str]:
    """Return a type for each parameter, the first type of `either`: PlanSys2's messages have one type."""
    return [group.types[0] if group.types else ROOT_TYPE for group in parameters for _ in group.names]


def _parameters(
    domain: Domain, action: ActionSchema, parameter_names: Sequence[str]
) -> tuple[list[Message], dict[str, str]]:
    """Return an action's parameters with the requested names, and these names by variable."""
    variables = names_of(action.parameters)
    defaults = [f"?{index}" for index in range(len(variables))]
    names = [*parameter_names[: len(variables)], *defaults[len(parameter_names) :]]
    types = _types_in(action.parameters)
    parameters = [param(name, kind, subtypes(domain, kind)) for name, kind in zip(names, types, strict=True)]
    return parameters, dict(zip(variables, names, strict=True))


def _action_of(domain: Domain, name: str, *, durative: bool) -> ActionSchema:
    actions = {action.name: action for action in domain.actions if action.durative is durative}
    return actions[_find_name(name, actions, "durative action" if durative else "action")]


def _find_name(name: str, names: Iterable[str], noun: str) -> str:
    """Return the matching name, ignoring case if necessary."""
    known_names = [*names]
    if name in known_names:
        return name
    for known_name in known_names:
        if known_name.lower() == name.lower():
            return known_name
    raise Ros2Error(f"the domain has no {noun} '{name}'", hint=did_you_mean(name, known_names))


# Services of the domain expert, by the last part of the name.
DOMAIN_SERVICES: Final[Mapping[str, ExpertService]] = {
    "get_domain": ExpertService(_domain),
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
