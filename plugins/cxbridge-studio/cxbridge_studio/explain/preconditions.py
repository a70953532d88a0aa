"""Finds the atoms that make the precondition of an action false.

The conditions and the true atoms come from facts: the core asserts a fact for each formula and predicate of
the PDDL domain, and a ``domain-fact`` for each true atom.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from cxbridge.clipstext.values import constants_of, lone_value_text
from cxbridge.executive.pddl.ast import BlamedPart, TermComparison, Variable
from cxbridge.executive.problem.conditions import FormulaMaker
from cxbridge.executive.problem.truth import KnownState, blamed_parts
from cxbridge.suggestions import MIN_LIKENESS, likeness
from cxbridge_studio.explain.slot_values import parse_values

# A function that returns the slots of a deftemplate's facts, as CLIPS prints the values.
FactLookup = Callable[[str], Sequence[Mapping[str, str]]]

Atom = tuple[str, ...]  # a predicate and its arguments


def parse_fields(text: str) -> tuple[str, ...]:
    """Return the fields of a printed multislot."""
    return tuple(lone_value_text(value) for value in parse_values(text))


def format_atom(atom: Atom) -> str:
    return f"({' '.join(atom)})"


class Preconditions:
    """The conditions of a domain, and its facts at one moment.

    :param find_facts: finds the facts of ``pddl-formula``, ``pddl-predicate`` and ``domain-fact``.
    """

    def __init__(self, find_facts: FactLookup) -> None:
        self._find_facts = find_facts
        self._conditions = FormulaMaker(
            find_facts("pddl-formula"), map(_parse_predicate_slots, find_facts("pddl-predicate"))
        )

    @cached_property
    def _true_atoms(self) -> list[Atom]:
        """The true atoms, read on first use."""
        return [
            (slots.get("name", ""), *parse_fields(slots.get("param-values", "")))
            for slots in self._find_facts("domain-fact")
        ]

    def describe_blame(self, operator: str, arguments: Mapping[str, str]) -> list[str]:
        """Return a text about each atom that makes an operator's precondition false.

        The list is empty if the precondition is true, or the operator has none.

        :param arguments: the values by parameter.
        """
        condition = self._conditions.operator_condition(operator)
        if condition is None:
            return []
        bound_values = {
            term.name: arguments.get(term.name, f"?{term.name}")
            for formula in condition.walk()
            for term in formula.terms
            if isinstance(term, Variable)
        }
        # only quantifiers need objects, and the facts have no quantifiers
        state = KnownState({(name, tuple(values)) for name, *values in self._true_atoms}, {})
        texts = (
            self._describe(_ground_formula(blamed_part), expected_truth=blamed_part.required)
            for blamed_part in blamed_parts(condition, state, bound_values)
        )
        return list(dict.fromkeys(texts))  # two branches of a condition may blame the same atom

    def _describe(self, atom: Atom, *, expected_truth: bool) -> str:
        """Return why an atom does not have the expected truth."""
        unbound_variables = [word for word in atom if word.startswith("?")]
        if unbound_variables:
            return f"{format_atom(atom)} has no value for {', '.join(unbound_variables)}"
        if not expected_truth:
            return f"{format_atom(atom)} is true"
        # A true atom that differs in one similar argument hints at a misspelling.
        similarity, nearest_atom = max(
            (
                (_compute_likeness(atom, true_atom), true_atom)
                for true_atom in self._true_atoms
                if true_atom[0] == atom[0] and len(true_atom) == len(atom)
            ),
            default=(0.0, atom),
        )
        similar_text = f" ({format_atom(nearest_atom)} is true)" if similarity > MIN_LIKENESS else ""
        return f"{format_atom(atom)} is false{similar_text}"


def _parse_predicate_slots(slots: Mapping[str, str]) -> Mapping[str, Any]:
    """Return the slots of a predicate with its multislots parsed, as :class:`FormulaMaker` requires."""
    return {
        **slots,
        **{name: parse_fields(slots.get(name, "")) for name in ("param-names", "param-constants")},
    }


def _ground_formula(blamed_part: BlamedPart) -> Atom:
    """Return a blamed formula with the values of its variables."""
    # A comparison of terms is an atom of the predicate `=`.
    name = (
        "="
        if isinstance(blamed_part.formula, TermComparison)
        else getattr(blamed_part.formula, "predicate", "")
    )
    terms = (
        blamed_part.binding[term.name] if isinstance(term, Variable) else getattr(term, "name", "")
        for term in blamed_part.formula.terms
    )
    return (name, *terms)


def ground_predicate(predicate: Mapping[str, str], arguments: Mapping[str, str]) -> Atom:
    """Return the ground atom of a predicate; a parameter without a value becomes ``?NAME``.

    :param predicate: the slots of a fact ``pddl-predicate``, or of a fact with the same slots.
    :param arguments: the values by parameter.
    """
    predicate_name = predicate.get("predicate", "")
    parameters = parse_fields(predicate.get("param-names", ""))
    constants = constants_of(parameters, parse_fields(predicate.get("param-constants", "")))
    terms = [
        arguments.get(parameter, f"?{parameter}") if constant is None else constant
        for parameter, constant in zip(parameters, constants, strict=True)
    ]
    # In the facts of the PDDL domain, the predicate `=` has the name EQUALITY.
    return ("=" if predicate_name == "EQUALITY" else predicate_name, *terms)


def _compute_likeness(atom: Atom, other_atom: Atom) -> float:
    """Return the similarity of two atoms of the same length that differ in one argument; else 0."""
    differing_pairs = [
        (word, other_word) for word, other_word in zip(atom, other_atom, strict=True) if word != other_word
    ]
    return likeness(*differing_pairs[0]) if len(differing_pairs) == 1 else 0.0
