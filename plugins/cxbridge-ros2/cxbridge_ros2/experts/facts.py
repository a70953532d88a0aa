"""Domain and problem knowledge in the facts of an environment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
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
from cxbridge.executive.problem.conditions import Conditions, Slots, atom_of, list_in, text_in
from cxbridge.executive.problem.facts import (
    FUNCTION,
    INSTANCE,
    PREDICATE,
    ground_in,
    numbers_in,
    put_number,
    slots_of,
)
from cxbridge_ros2.experts.knowledge import Knowledge

UNNAMED: Final = "domain"  # name of the domain before any is parsed

_REQUIREMENTS: Final = ("strips", "typing", "negative-preconditions")
_GOAL: Final = "problem-goal"
# Ordered facts that the core asserts for each object, but does not retract with it.
_TYPE_OF: Final = "domain-obj-is-of-type"


class FactKnowledge(Knowledge):
    """Knowledge stored as facts.

    :param env: the environment, whose lock must be held.
    :param numbers: numbers for unique goal ids.
    """

    def __init__(self, env: ClipsEnvironment, numbers: Iterator[int]) -> None:
        self._env = env
        self._numbers = numbers

    @property
    def instances(self) -> dict[str, str]:
        return {str(name): str(kind) for name, kind in self._env.columns(INSTANCE, "name", "type")}

    @property
    def predicates(self) -> list[Ground]:
        return [*dict.fromkeys(ground_in(slots) for _, _, slots in self._env.facts(PREDICATE))]

    @property
    def functions(self) -> dict[Ground, float]:
        return numbers_in(self._env)

    @property
    def goal(self) -> str:
        return next((str(formula) for (formula,) in reversed([*self._env.columns(_GOAL, "formula")])), "")

    def put_instance(self, name: str, kind: str) -> None:
        self._assert(INSTANCE, {"name": clips_scalar(name), "type": Symbol(kind)})

    def put_predicate(self, ground: Ground) -> None:
        self._assert(PREDICATE, slots_of(ground))

    def put_function(self, ground: Ground, value: float) -> None:
        put_number(self._env, ground, value)

    def put_goal(self, formula: str) -> None:
        """Assert a goal in place of all current goals."""
        self._retract(_GOAL, lambda _slots: True)
        if formula:
            self._assert(_GOAL, {"id": Symbol(f"{_GOAL}-{next(self._numbers)}"), "formula": formula})

    def drop_instance(self, name: str) -> None:
        """Retract an object and its type facts."""
        self._retract(INSTANCE, lambda slots: str(slots["name"]) == name)
        self._retract(_TYPE_OF, lambda slots: _first(slots["implied"]) == name)

    def drop_predicate(self, ground: Ground) -> None:
        self._retract(PREDICATE, lambda slots: ground_in(slots) == ground)

    def drop_function(self, ground: Ground) -> None:
        self._retract(FUNCTION, lambda slots: ground_in(slots) == ground)

    def _assert(self, template: str, slots: Slots) -> None:
        if not self._env.has_template(template):
            raise PddlError(f"the agent has no template {template}", hint="its core has no domain")
        self._env.assert_fact(template, slots)

    def _retract(self, template: str, is_meant: Callable[[Slots], bool]) -> None:
        for index, _, slots in list(self._env.facts(template)):
            if is_meant(slots):
                self._env.retract(index)


def domain_of_facts(env: ClipsEnvironment, parsed: Domain | None) -> Domain | None:
    """Return the domain, extended by types, predicates and operators that exist only as facts.

    :param parsed: the domain that was parsed last, or None.
    :returns: None if there is neither a domain nor a fact of one.
    """
    domain = parsed or Domain(UNNAMED, _REQUIREMENTS)
    known = {ROOT_TYPE, *names_of(domain.types)}
    types = tuple(
        TypedNames((name,), (parent,) if parent != name else ())
        for name, parent in _texts(env, "domain-object-type", "name", "super-type")
        if name not in known
    )
    known_predicates = {each.name for each in domain.predicates}
    predicates = tuple(
        Predicate(
            text_in(slots, "name"),
            _parameters(list_in(slots, "param-names"), list_in(slots, "param-types")),
        )
        for slots in _rows(env, "domain-predicate")
        if text_in(slots, "name") not in known_predicates
    )
    known_actions = {each.name for each in domain.actions}
    operators = [each for each in _rows(env, "domain-operator") if text_in(each, "name") not in known_actions]
    actions = tuple(_Operators(env).actions(operators)) if operators else ()
    if parsed is None and not (types or predicates or actions):
        return None
    if not (types or predicates or actions):
        return domain
    return domain.changed(
        types=domain.types + types,
        predicates=domain.predicates + predicates,
        actions=domain.actions + actions,
    )


class _Operators:
    """Makes actions from the facts about operators."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self._parameters = _rows(env, "domain-operator-parameter")
        self._conditions = Conditions(_rows(env, "pddl-formula"), _rows(env, "pddl-predicate"))
        self._effects = _rows(env, "domain-effect")

    def actions(self, operators: list[Slots]) -> Iterator[ActionSchema]:
        for slots in operators:
            name = text_in(slots, "name")
            types = {
                text_in(each, "name"): text_in(each, "type")
                for each in self._parameters
                if text_in(each, "operator") == name
            }
            names = list_in(slots, "param-names") or [*types]
            yield ActionSchema(
                name,
                _parameters(names, [types.get(each, ROOT_TYPE) for each in names]),
                self._conditions.of(name),
                And(tuple(self._effects_of(name))),
            )

    def _effects_of(self, operator: str) -> Iterator[Formula]:
        for slots in self._effects:
            if text_in(slots, "part-of") == operator:
                atom = atom_of(slots)
                yield Not(atom) if text_in(slots, "type") == "NEGATIVE" else atom


def _parameters(names: list[str], types: list[str]) -> tuple[TypedNames, ...]:
    every = [*types, *[ROOT_TYPE] * len(names)]
    return tuple(TypedNames((name,), (kind,)) for name, kind in zip(names, every, strict=False))


def _rows(env: ClipsEnvironment, template: str) -> list[Slots]:
    return [slots for _, _, slots in env.facts(template)]


def _texts(env: ClipsEnvironment, template: str, *slots: str) -> list[tuple[str, ...]]:
    return [tuple(map(str, row)) for row in env.columns(template, *slots)]


def _first(value: Value) -> str:
    return str(value[0]) if isinstance(value, tuple) and value else ""
