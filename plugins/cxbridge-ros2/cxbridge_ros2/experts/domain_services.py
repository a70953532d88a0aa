"""The services of PlanSys2's domain expert by name, each with its handler."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    And,
    Declaration,
    Domain,
    Formula,
    Timed,
    TypedList,
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.printer import format_domain
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.knowledge import ProblemExpert, find_subtypes
from cxbridge_ros2.experts.problem_services import ExpertService
from cxbridge_ros2.experts.trees import TreeCodec, TreeNodeKind, make_param
from cxbridge_ros2.messages import Message

# Fields of a DurativeAction: the time in PDDL, and the attribute of the action with the formula.
_TIMED_FIELDS: Final = {
    "at_start_requirements": ("at start", "condition"),
    "over_all_requirements": ("over all", "condition"),
    "at_end_requirements": ("at end", "condition"),
    "at_start_effects": ("at start", "effect"),
    "at_end_effects": ("at end", "effect"),
}


def _get_types(expert: ProblemExpert, _codec: TreeCodec, _request: Message) -> Mapping[str, Any]:
    # a type with several supertypes is declared several times
    return {"types": [name for name in dict.fromkeys(names_of(expert.domain.types)) if name != ROOT_TYPE]}


def _get_constants(expert: ProblemExpert, _codec: TreeCodec, request: Message) -> Mapping[str, Any]:
    domain = expert.domain
    type_name = _find_name(request["type"], (ROOT_TYPE, *names_of(domain.types)), "type")
    return {
        "constants": [name for name, type_ in pairs_of(domain.constants) if (type_ or ROOT_TYPE) == type_name]
    }


def _get_actions(
    expert: ProblemExpert, _codec: TreeCodec, _request: Message, *, is_durative: bool
) -> Mapping[str, Any]:
    return {"actions": [action.name for action in expert.domain.actions if action.is_durative is is_durative]}


def _get_action_details(
    expert: ProblemExpert, codec: TreeCodec, request: Message, *, field: str
) -> Mapping[str, Any]:
    """Return the details of an action.

    :param field: the field of the name in the request, and of the action in the response: ``action`` or
        ``durative_action``.
    """
    domain, is_durative = expert.domain, field == "durative_action"
    actions = {action.name: action for action in domain.actions if action.is_durative is is_durative}
    action = actions[_find_name(request[field], actions, field.replace("_", " "))]
    parameters, names = _make_parameters(domain, action, request["parameters"])
    formulas = (
        {
            tree_field: _select_timed(when, getattr(action, attribute))
            for tree_field, (when, attribute) in _TIMED_FIELDS.items()
        }
        if is_durative
        else {"preconditions": action.condition, "effects": action.effect}
    )
    encode_tree = partial(codec.encode_formula, names=names, find_types=partial(_find_types, domain))
    trees = {tree_field: encode_tree(formula) for tree_field, formula in formulas.items()}
    return {field: {"name": request[field], "parameters": parameters, **trees}}


def _select_timed(when: str, formula: Formula | None) -> Formula:
    """Return the parts of a formula for a time; without a part, an empty conjunction, as in PlanSys2."""
    conjuncts = formula.parts if isinstance(formula, And) else (formula,)
    return And(tuple(timed.part for timed in conjuncts if isinstance(timed, Timed) and timed.when == when))


def _get_declarations(
    expert: ProblemExpert, _codec: TreeCodec, _request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    declarations = _select_declarations(expert.domain, kind)
    return {"states": [{"node_type": int(kind), "name": declaration.name} for declaration in declarations]}


def _get_declaration_details(
    expert: ProblemExpert, _codec: TreeCodec, request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    domain, noun = expert.domain, kind.name.lower()
    declarations = {declaration.name: declaration for declaration in _select_declarations(domain, kind)}
    declaration = declarations[_find_name(request["expression"], declarations, noun)]
    # names as in PlanSys2: ?robot0, ?room1
    parameters = [
        make_param(f"?{name}{index}", name, find_subtypes(domain, name))
        for index, name in enumerate(_list_types(declaration.parameters))
    ]
    return {"node": {"node_type": int(kind), "name": declaration.name, "parameters": parameters}}


def _get_derived_predicates(expert: ProblemExpert, _codec: TreeCodec, _request: Message) -> Mapping[str, Any]:
    _ = expert.domain  # raises the error about a missing domain
    return {"states": []}  # cxbridge does not support derived predicates


def _get_derived_predicate_details(
    _expert: ProblemExpert, _codec: TreeCodec, request: Message
) -> Mapping[str, Any]:
    raise Ros2Error(f"'{request['predicate']}': derived predicates are not supported")


def _select_declarations(domain: Domain, kind: TreeNodeKind) -> Sequence[Declaration]:
    return domain.predicates if kind is TreeNodeKind.PREDICATE else domain.functions


def _find_types(domain: Domain, name: str) -> tuple[str, ...]:
    """Return the types of the parameters of a predicate or a function; empty if unknown."""
    declarations = {
        declaration.name: declaration.parameters for declaration in (*domain.functions, *domain.predicates)
    }
    return tuple(_list_types(declarations.get(name, ())))


def _list_types(parameters: TypedList) -> list[str]:
    """Return the type of each parameter; the first type of an ``either``, since messages have one type."""
    return [group.types[0] if group.types else ROOT_TYPE for group in parameters for _ in group.names]


def _make_parameters(
    domain: Domain, action: ActionSchema, parameter_names: Sequence[str]
) -> tuple[list[Message], dict[str, str]]:
    """Return the parameters of an action with the requested names, and the names by variable.

    A parameter without a requested name gets the name ``?INDEX``, as in PlanSys2.
    """
    variables = names_of(action.parameters)
    defaults = [f"?{index}" for index in range(len(variables))]
    names = [*parameter_names[: len(variables)], *defaults[len(parameter_names) :]]
    types = _list_types(action.parameters)
    parameters = [
        make_param(name, type_name, find_subtypes(domain, type_name))
        for name, type_name in zip(names, types, strict=True)
    ]
    return parameters, dict(zip(variables, names, strict=True))


def _find_name(name: str, names: Collection[str], noun: str) -> str:
    """Return a name unchanged if it is among the names, otherwise the first name that differs only in case.

    PDDL ignores the case of names.

    :param noun: the kind of names, for the error.
    :raises Ros2Error: if there is no such name.
    """
    equal_names = [known_name for known_name in names if known_name.lower() == name.lower()]
    if not equal_names:
        raise Ros2Error(f"the domain has no {noun} '{name}'", hint=did_you_mean(name, names))
    return name if name in equal_names else equal_names[0]


# Services of the domain expert, by name.
DOMAIN_SERVICES: Final[Mapping[str, ExpertService]] = {
    "/domain_expert/get_domain": ExpertService(
        lambda expert, _codec, _request: {"domain": format_domain(expert.domain)}
    ),
    "/domain_expert/get_domain_name": ExpertService(
        lambda expert, _codec, _request: {"name": expert.domain.name}
    ),
    "/domain_expert/get_domain_types": ExpertService(_get_types),
    "/domain_expert/get_domain_constants": ExpertService(_get_constants, "Type not found"),
    "/domain_expert/get_domain_actions": ExpertService(partial(_get_actions, is_durative=False)),
    "/domain_expert/get_domain_action_details": ExpertService(
        partial(_get_action_details, field="action"), "Action not found"
    ),
    "/domain_expert/get_domain_durative_actions": ExpertService(partial(_get_actions, is_durative=True)),
    "/domain_expert/get_domain_durative_action_details": ExpertService(
        partial(_get_action_details, field="durative_action"), "Durative action not found"
    ),
    "/domain_expert/get_domain_predicates": ExpertService(
        partial(_get_declarations, kind=TreeNodeKind.PREDICATE)
    ),
    "/domain_expert/get_domain_predicate_details": ExpertService(
        partial(_get_declaration_details, kind=TreeNodeKind.PREDICATE), "Predicate not found"
    ),
    "/domain_expert/get_domain_functions": ExpertService(
        partial(_get_declarations, kind=TreeNodeKind.FUNCTION)
    ),
    "/domain_expert/get_domain_function_details": ExpertService(
        partial(_get_declaration_details, kind=TreeNodeKind.FUNCTION), "Function not found"
    ),
    "/domain_expert/get_domain_derived_predicates": ExpertService(_get_derived_predicates),
    "/domain_expert/get_domain_derived_predicate_details": ExpertService(
        _get_derived_predicate_details, "Derived predicate not found"
    ),
}
