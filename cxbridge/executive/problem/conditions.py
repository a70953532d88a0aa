"""The domain of an environment: what was parsed, and what rules and files have added to it as facts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.terms import constants_of
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    ActionSchema,
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    Not,
    Or,
    Predicate,
    Term,
    TermComparison,
    TypedNames,
    Variable,
    names_of,
)
from cxbridge.executive.pddl.facts import EQUALITY

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value

UNNAMED: Final = "domain"
"""What a domain is called that nobody has parsed."""

_REQUIREMENTS: Final = ("strips", "typing", "negative-preconditions")
_PAIR: Final = 2
_DEEPEST: Final = 50
"""Levels of a formula; facts that an agent asserts may be part of each other."""

Slots = Mapping[str, "Value"]


def domain_of_facts(env: ClipsEnvironment, parsed: Domain | None) -> Domain | None:
    """Return the domain, with the types, predicates and operators that are facts only.

    :param parsed: the domain that the environment parsed last.
    :returns: None when there is neither a domain nor a fact of one.
    """
    domain = parsed or Domain(UNNAMED, _REQUIREMENTS)
    known = {ROOT_TYPE, *names_of(domain.types)}
    types = tuple(
        TypedNames((name,), (above,) if above != name else ())
        for name, above in _texts(env, "domain-object-type", "name", "super-type")
        if name not in known
    )
    named = {each.name for each in domain.predicates}
    predicates = tuple(
        Predicate(_text(slots, "name"), _parameters(_list(slots, "param-names"), _list(slots, "param-types")))
        for slots in _rows(env, "domain-predicate")
        if _text(slots, "name") not in named
    )
    acting = {each.name for each in domain.actions}
    operators = [each for each in _rows(env, "domain-operator") if _text(each, "name") not in acting]
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


class Conditions:
    """Makes formulas of the facts about them.

    :param formulas: the facts ``pddl-formula``.
    :param atoms: the facts ``pddl-predicate``.
    """

    def __init__(self, formulas: Iterable[Slots], atoms: Iterable[Slots]) -> None:
        # a formula of which two formulas are parents would be looked at 2^N times below N such formulas
        self._formulas: dict[str, list[Slots]] = {}
        for slots in {_text(slots, "id"): slots for slots in formulas}.values():
            self._formulas.setdefault(_text(slots, "part-of"), []).append(slots)
        self._atoms: dict[str, list[Slots]] = {}
        for slots in atoms:
            self._atoms.setdefault(_text(slots, "part-of"), []).append(slots)

    def of(self, operator: str) -> Formula | None:
        """Return the condition of an operator; None when it has none."""
        parts = self._below(operator, ())
        return parts[0] if len(parts) == 1 else And(tuple(parts)) if parts else None

    def _below(self, parent: str, above: tuple[str, ...]) -> list[Formula]:
        """Return the formulas and atoms that are part of something. A formula that is part of itself ends."""
        atoms = [_atom(each) for each in self._atoms.get(parent, ())]
        if parent in above or len(above) > _DEEPEST:
            return [*atoms]
        inner = (*above, parent)
        return [*atoms, *(self._formula(each, inner) for each in self._formulas.get(parent, ()))]

    def _formula(self, slots: Slots, above: tuple[str, ...]) -> Formula:
        parts, kind = self._below(_text(slots, "id"), above), _text(slots, "type")
        if kind == "negation" and parts:
            return Not(parts[0] if len(parts) == 1 else And(tuple(parts)))
        if kind == "disjunction":
            return Or(tuple(parts))
        return parts[0] if kind == "atom" and parts else And(tuple(parts))


class _Operators:
    """Makes actions of the facts about operators."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self._parameters = _rows(env, "domain-operator-parameter")
        self._conditions = Conditions(_rows(env, "pddl-formula"), _rows(env, "pddl-predicate"))
        self._effects = _rows(env, "domain-effect")

    def actions(self, operators: list[Slots]) -> Iterator[ActionSchema]:
        for slots in operators:
            name = _text(slots, "name")
            types = {
                _text(each, "name"): _text(each, "type")
                for each in self._parameters
                if _text(each, "operator") == name
            }
            names = _list(slots, "param-names") or [*types]
            yield ActionSchema(
                name,
                _parameters(names, [types.get(each, ROOT_TYPE) for each in names]),
                self._conditions.of(name),
                And(tuple(self._effects_of(name))),
            )

    def _effects_of(self, operator: str) -> Iterator[Formula]:
        for slots in self._effects:
            if _text(slots, "part-of") == operator:
                atom = _atom(slots)
                yield Not(atom) if _text(slots, "type") == "NEGATIVE" else atom


def _atom(slots: Slots) -> Formula:
    names, constants = _list(slots, "param-names"), _list(slots, "param-constants")
    terms: list[Term] = [
        Variable(name) if constant is None else Constant(constant)
        for name, constant in zip(names, constants_of(names, constants), strict=True)
    ]
    predicate = _text(slots, "predicate")
    if predicate == EQUALITY and len(terms) == _PAIR:
        return TermComparison("=", terms[0], terms[1])
    return Atom(predicate, tuple(terms))


def _parameters(names: list[str], types: list[str]) -> tuple[TypedNames, ...]:
    every = [*types, *[ROOT_TYPE] * len(names)]
    return tuple(TypedNames((name,), (kind,)) for name, kind in zip(names, every, strict=False))


def _rows(env: ClipsEnvironment, template: str) -> list[Slots]:
    return [slots for _, _, slots in env.facts(template)]


def _texts(env: ClipsEnvironment, template: str, *slots: str) -> list[tuple[str, ...]]:
    return [tuple(map(str, row)) for row in env.columns(template, *slots)]


def _text(slots: Slots, name: str) -> str:
    return str(slots.get(name, ""))


def _list(slots: Slots, name: str) -> list[str]:
    values = slots.get(name, ())
    return [str(each) for each in values] if isinstance(values, tuple) else []
