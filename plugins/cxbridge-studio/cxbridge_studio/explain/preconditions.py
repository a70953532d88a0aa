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
from cxbridge.suggestions import MIN_LIKENESS, likeness

# Returns the slots of a deftemplate's facts, as CLIPS prints the values.
FactsOf = Callable[[str], Sequence[Mapping[str, str]]]

_EQUALITY: Final = "EQUALITY"  # the predicate of `=` in the facts of formulas

Atom = tuple[str, ...]  # a predicate and its arguments


def _no_objects(_types: tuple[str, ...]) -> Collection[str]:
    """Return no objects: conditions of facts have no quantifiers, which need the objects of a type."""
    return ()


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
    def _true_atoms(self) -> list[Atom]:
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
        formulas = condition.walk()
        variables = {
            term.name for formula in formulas for term in formula.terms if isinstance(term, Variable)
        }
        bound = {name: arguments.get(name, f"?{name}") for name in variables}
        state = KnownState({(name, tuple(values)) for name, *values in self._true_atoms}, {}, _no_objects)
        blamed_atoms = to_blame(condition, state, bound)
        # Two branches of a condition may blame the same atom.
        texts = (self._describe(_ground(blamed), expected_truth=blamed.wanted) for blamed in blamed_atoms)
        return list(dict.fromkeys(texts))

    def _describe(self, atom: Atom, *, expected_truth: bool) -> str:
        unknown = [word for word in atom if word.startswith("?")]
        if unknown:
            return f"{atom_text(atom)} has no value for {', '.join(unknown)}"
        if not expected_truth:
            return f"{atom_text(atom)} is true"
        # A true atom that differs in one similar argument hints at a misspelling.
        comparable = [
            true_atom
            for true_atom in self._true_atoms
            if true_atom[0] == atom[0] and len(true_atom) == len(atom)
        ]
        similarity, nearest_atom = max(
            ((_likeness(atom, true_atom), true_atom) for true_atom in comparable), default=(0.0, atom)
        )
        similar = f" ({atom_text(nearest_atom)} is true)" if similarity > MIN_LIKENESS else ""
        return f"{atom_text(atom)} is false{similar}"


def _with_fields(slots: Mapping[str, str]) -> Mapping[str, Any]:
    """Return the slots of a predicate, multislots as fields: `Conditions` parses no printed facts."""
    return {**slots, **{name: fields(slots.get(name, "")) for name in ("param-names", "param-constants")}}


def _ground(blamed: Blamed) -> Atom:
    """Return a blamed formula with the values of its variables."""
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


def _likeness(first: Atom, second: Atom) -> float:
    """Return the similarity of two atoms that differ in one argument; 0 if they differ in more."""
    pairs = [pair for pair in zip(first, second, strict=True) if pair[0] != pair[1]]
    return likeness(*pairs[0]) if len(pairs) == 1 else 0.0
