"""The domain and the problem in the facts of a CLIPS environment.

Rules may assert objects, facts and operators that no PDDL file contains. Clients of the experts see these,
too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import zip_longest
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    And,
    Domain,
    Formula,
    Ground,
    Not,
    Predicate,
    TypedNames,
    names_of,
)
from cxbridge.executive.problem.conditions import Conditions, Slots, make_atom, slot_text, slot_texts
from cxbridge.executive.problem.facts import (
    FUNCTION,
    INSTANCE,
    PREDICATE,
    ground_of_slots,
    numbers_in,
    set_number,
    slots_of_ground,
)
from cxbridge_ros2.experts.knowledge import Knowledge

UNNAMED_DOMAIN: Final = "domain"  # name of a domain that exists only as facts

_REQUIREMENTS: Final = ("strips", "typing", "negative-preconditions")
_GOAL_TEMPLATE: Final = "problem-goal"
# Template of facts that the CX core asserts for each object, but does not retract with the object.
_TYPE_TEMPLATE: Final = "domain-obj-is-of-type"


class FactKnowledge(Knowledge):
    """Knowledge stored as facts.

    :param env: the environment, whose lock the caller holds.
    :param goal_numbers: numbers for the ids of new goals.
    """

    def __init__(self, env: ClipsEnvironment, goal_numbers: Iterator[int]) -> None:
        self._env = env
        self._goal_numbers = goal_numbers

    @property
    def instances(self) -> dict[str, str]:
        return {str(name): str(type_name) for name, type_name in self._env.columns(INSTANCE, "name", "type")}

    @property
    def predicates(self) -> list[Ground]:
        return [*dict.fromkeys(ground_of_slots(slots) for _, _, slots in self._env.facts(PREDICATE))]

    @property
    def functions(self) -> dict[Ground, float]:
        return numbers_in(self._env)

    @property
    def goal(self) -> str:
        """The formula of the latest goal; empty without a goal."""
        return next(
            (str(formula) for (formula,) in reversed([*self._env.columns(_GOAL_TEMPLATE, "formula")])), ""
        )

    def put_instance(self, name: str, type_name: str) -> None:
        self._assert(INSTANCE, {"name": clips_scalar(name), "type": Symbol(type_name)})

    def put_predicate(self, ground: Ground) -> None:
        self._assert(PREDICATE, slots_of_ground(ground))

    def put_function(self, ground: Ground, value: float) -> None:
        set_number(self._env, ground, value)

    def put_goal(self, formula: str) -> None:
        """Assert a goal in place of all current goals."""
        self._retract(_GOAL_TEMPLATE, lambda _slots: True)
        if formula:
            self._assert(
                _GOAL_TEMPLATE,
                {"id": Symbol(f"{_GOAL_TEMPLATE}-{next(self._goal_numbers)}"), "formula": formula},
            )

    def drop_instance(self, name: str) -> None:
        """Retract an object and its type facts."""
        self._retract(INSTANCE, lambda slots: str(slots["name"]) == name)
        self._retract(_TYPE_TEMPLATE, lambda slots: slot_texts(slots, "implied")[:1] == [name])

    def drop_predicate(self, ground: Ground) -> None:
        self._retract(PREDICATE, lambda slots: ground_of_slots(slots) == ground)

    def drop_function(self, ground: Ground) -> None:
        self._retract(FUNCTION, lambda slots: ground_of_slots(slots) == ground)

    def _assert(self, template: str, slots: Slots) -> None:
        if not self._env.has_template(template):
            raise PddlError(f"the agent has no template {template}", hint="use a core that stores the domain")
        self._env.assert_fact(template, slots)

    def _retract(self, template: str, matches: Callable[[Slots], bool]) -> None:
        for index, _, slots in list(self._env.facts(template)):
            if matches(slots):
                self._env.retract(index)


def extend_domain(env: ClipsEnvironment, parsed_domain: Domain | None) -> Domain | None:
    """Extend a domain by the types, predicates and operators that exist only as facts.

    :param parsed_domain: the last parsed domain, or None.
    :returns: the domain; None if there is neither a parsed domain nor a fact about a domain.
    """
    domain = parsed_domain or Domain(UNNAMED_DOMAIN, _REQUIREMENTS)
    type_names = {ROOT_TYPE, *names_of(domain.types)}
    types = tuple(
        TypedNames((str(name),), (str(parent),) if parent != name else ())
        for name, parent in env.columns("domain-object-type", "name", "super-type")
        if str(name) not in type_names
    )
    predicate_names = {predicate.name for predicate in domain.predicates}
    predicates = tuple(
        Predicate(
            slot_text(slots, "name"),
            _make_parameters(slot_texts(slots, "param-names"), slot_texts(slots, "param-types")),
        )
        for slots in _list_slots(env, "domain-predicate")
        if slot_text(slots, "name") not in predicate_names
    )
    action_names = {action.name for action in domain.actions}
    operators = [
        slots for slots in _list_slots(env, "domain-operator") if slot_text(slots, "name") not in action_names
    ]
    # the condition saves time: operators have many facts, and usually a parsed domain has all operators
    actions = tuple(_make_actions(env, operators)) if operators else ()
    if not (types or predicates or actions):
        return parsed_domain
    return domain.changed(
        types=domain.types + types,
        predicates=domain.predicates + predicates,
        actions=domain.actions + actions,
    )


def _make_actions(env: ClipsEnvironment, operators: list[Slots]) -> Iterator[ActionSchema]:
    """Yield the actions of operators, made of the facts about parameters, conditions and effects."""
    parameter_rows, effects = _list_slots(env, "domain-operator-parameter"), _list_slots(env, "domain-effect")
    conditions = Conditions(_list_slots(env, "pddl-formula"), _list_slots(env, "pddl-predicate"))
    for operator in operators:
        name = slot_text(operator, "name")
        types = {
            slot_text(slots, "name"): slot_text(slots, "type")
            for slots in parameter_rows
            if slot_text(slots, "operator") == name
        }
        parameters = slot_texts(operator, "param-names") or [*types]
        yield ActionSchema(
            name,
            _make_parameters(parameters, [types.get(parameter, ROOT_TYPE) for parameter in parameters]),
            conditions.operator_condition(name),
            And(tuple(_make_effect(slots) for slots in effects if slot_text(slots, "part-of") == name)),
        )


def _make_effect(slots: Slots) -> Formula:
    atom = make_atom(slots)
    return Not(atom) if slot_text(slots, "type") == "NEGATIVE" else atom


def _make_parameters(names: list[str], types: list[str]) -> tuple[TypedNames, ...]:
    """Return parameters; a parameter without a type gets PDDL's type ``object``."""
    return tuple(
        TypedNames((name,), (type_name,))
        for name, type_name in zip_longest(names, types[: len(names)], fillvalue=ROOT_TYPE)
    )


def _list_slots(env: ClipsEnvironment, template: str) -> list[Slots]:
    return [slots for _, _, slots in env.facts(template)]
