"""Finds the atoms that make the precondition of an action false."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

from cxbridge.clipstext.facts import parse_values
from cxbridge.clipstext.values import constants_of, show_alone
from cxbridge.executive.pddl.ast import Blamed, TermComparison, Variable
from cxbridge.executive.problem.conditions import Conditions
from cxbridge.executive.problem.truth import KnownState, to_blame
from cxbridge.suggestions import LIKE, likeness

# Returns the slots of a deftemplate's facts, as CLIPS prints the values.
FactsOf = Callable[[str], Sequence[Mapping[str, str]]]

_EQUALITY: Final = "EQUALITY"


def _no_objects(_types: tuple[str, ...]) -> Collection[str]:
    return ()


Atom = tuple[str, ...]  # a predicate and its arguments


def fields(text: str) -> tuple[str, ...]:
    """Return the fields of a printed multislot."""
    return tuple(show_alone(value) for value in parse_values(text))


def atom_text(atom: Atom) -> str:
    return f"({' '.join(atom)})"


class Preconditions:
    """The conditions of a domain, and its facts at one moment.

    :param facts_of: returns the facts of ``pddl-formula``, ``pddl-predicate`` and ``domain-fact``.
    """

    def __init__(self, facts_of: FactsOf) -> None:
        self._facts_of = facts_of
        self._conditions = Conditions(facts_of("pddl-formula"), map(_with_fields, facts_of("pddl-predicate")))

    @cached_property
    def _true(self) -> list[Atom]:
        """The true atoms, read on first use."""
        return [
            (slots.get("name", ""), *fields(slots.get("param-values", "")))
            for slots in self._facts_of("domain-fact")
        ]

    def blame(self, operator: str, arguments: Mapping[str, str]) -> list[str]:
        """Return the atoms that make the precondition of an operator false, in words; empty if it holds.

        :param arguments: values by parameter.
        """
        condition = self._conditions.of(operator)
        if condition is None:
            return []
        variables = {
            term.name for part in condition.walk() for term in part.terms if isinstance(term, Variable)
        }
        bound = {name: arguments.get(name, f"?{name}") for name in variables}
        state = KnownState({(name, tuple(values)) for name, *values in self._true}, {}, _no_objects)
        blamed = to_blame(condition, state, bound)
        return list(
            dict.fromkeys(self._described(_ground(each), expected_truth=each.wanted) for each in blamed)
        )

    def _described(self, atom: Atom, *, expected_truth: bool) -> str:
        unknown = [word for word in atom if word.startswith("?")]
        if unknown:
            return f"{atom_text(atom)} has no value for {', '.join(unknown)}"
        if not expected_truth:
            return f"{atom_text(atom)} is true"
        similar_atoms = [other for other in self._true if other[0] == atom[0] and len(other) == len(atom)]
        near = sorted(((_likeness(atom, other), other) for other in similar_atoms), reverse=True)[:1]
        also = "".join(f" ({atom_text(other)} is true)" for like, other in near if like > LIKE)
        return f"{atom_text(atom)} is false{also}"


def _with_fields(slots: Mapping[str, str]) -> Mapping[str, Any]:
    return {**slots, **{name: fields(slots.get(name, "")) for name in ("param-names", "param-constants")}}


def _ground(blamed: Blamed) -> Atom:
    name = "=" if isinstance(blamed.formula, TermComparison) else getattr(blamed.formula, "predicate", "")
    terms = (
        blamed.bound[term.name] if isinstance(term, Variable) else getattr(term, "name", "")
        for term in blamed.formula.terms
    )
    return (name, *terms)


def ground(predicate: Mapping[str, str], arguments: Mapping[str, str]) -> Atom:
    """Return the ground atom of a predicate; parameters without a value become ``?NAME``."""
    name = predicate.get("predicate", "")
    names = fields(predicate.get("param-names", ""))
    constants = constants_of(names, fields(predicate.get("param-constants", "")))
    terms = [
        arguments.get(name, f"?{name}") if constant is None else constant
        for name, constant in zip(names, constants, strict=True)
    ]
    return ("=" if name == _EQUALITY else name, *terms)


def _likeness(one: Atom, other: Atom) -> float:
    """Return the similarity of two atoms that differ in one argument; 0 if they differ in more."""
    pairs = [pair for pair in zip(one, other, strict=True) if pair[0] != pair[1]]
    return likeness(*pairs[0]) if len(pairs) == 1 else 0.0
