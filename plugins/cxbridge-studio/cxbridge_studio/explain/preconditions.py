"""Finds the atoms that make the precondition of an action false, from the facts of the domain."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from cxbridge.clipstext.facts import parse_values
from cxbridge.clipstext.terms import constants_of
from cxbridge.clipstext.values import show_alone
from cxbridge.suggestions import LIKE, likeness

FactsOf = Callable[[str], Sequence[Mapping[str, str]]]
"""Returns the facts of a deftemplate: slots, as CLIPS prints their values."""

_DEEPEST: Final = 50
_EQUALITY: Final = "EQUALITY"

Atom = tuple[str, ...]
"""A predicate and its arguments."""


def fields(text: str) -> tuple[str, ...]:
    """Return the fields of a multislot as CLIPS prints them one by one."""
    return tuple(show_alone(value) for value in parse_values(text))


def atom_text(atom: Atom) -> str:
    """Return an atom as PDDL has it."""
    return f"({' '.join(atom)})"


class Preconditions:
    """The conditions of a domain, and what is true of it at a moment.

    :param facts_of: gives the facts of ``pddl-formula``, ``pddl-predicate`` and ``domain-fact``.
    """

    def __init__(self, facts_of: FactsOf) -> None:
        self._facts_of = facts_of
        # A formula of which two formulas are parents would be looked at 2^N times below N such formulas.
        self._formulas = list({slots.get("id", ""): slots for slots in facts_of("pddl-formula")}.values())
        self._predicates = list(facts_of("pddl-predicate"))
        self._facts: list[Atom] | None = None

    @property
    def _true(self) -> list[Atom]:
        """The atoms that are true; read when they are first needed."""
        if self._facts is None:
            self._facts = [
                (slots.get("name", ""), *fields(slots.get("param-values", "")))
                for slots in self._facts_of("domain-fact")
            ]
        return self._facts

    def blame(self, operator: str, arguments: Mapping[str, str]) -> list[str]:
        """Return in words which atoms make the precondition of an operator false; none when it holds.

        :param arguments: the values of its parameters.
        """
        return list(dict.fromkeys(self._blame_parts(operator, arguments, wanted=True, depth=0)))

    def _blame_parts(
        self, parent: str, arguments: Mapping[str, str], *, wanted: bool, depth: int
    ) -> Iterator[str]:
        """Yield what is to blame among the parts of a formula.

        The same for all kinds: of a conjunction that is false the false parts are to blame, and all parts of
        a disjunction that is false are.
        """
        if depth > _DEEPEST:
            return
        for formula in self._formulas:
            if formula.get("part-of") == parent and self._holds(formula, arguments, depth) != wanted:
                inner = wanted if formula.get("type") != "negation" else not wanted
                yield from self._blame_parts(formula.get("id", ""), arguments, wanted=inner, depth=depth + 1)
        for predicate in self._predicates:
            if predicate.get("part-of") == parent:
                atom = ground(predicate, arguments)
                if self._is_true(atom) != wanted:
                    yield self._described(atom, wanted=wanted)

    def _holds(self, formula: Mapping[str, str], arguments: Mapping[str, str], depth: int) -> bool:
        name = formula.get("id", "")
        parts = [self._is_true(ground(p, arguments)) for p in self._predicates if p.get("part-of") == name]
        if depth < _DEEPEST:
            inner = (f for f in self._formulas if f.get("part-of") == name)
            parts += [self._holds(each, arguments, depth + 1) for each in inner]
        match formula.get("type"):
            case "disjunction":
                return any(parts)
            case "negation":
                return not all(parts)
        return all(parts)

    def _is_true(self, atom: Atom) -> bool:
        if atom[0] == "=":
            return len(set(atom[1:])) == 1
        return atom in self._true

    def _described(self, atom: Atom, *, wanted: bool) -> str:
        unknown = [word for word in atom if word.startswith("?")]
        if unknown:
            return f"{atom_text(atom)} has no value for {', '.join(unknown)}"
        if not wanted:
            return f"{atom_text(atom)} is true"
        others = [other for other in self._true if other[0] == atom[0] and len(other) == len(atom)]
        near = sorted(((_likeness(atom, other), other) for other in others), reverse=True)[:1]
        also = "".join(f" ({atom_text(other)} is true)" for like, other in near if like > LIKE)
        return f"{atom_text(atom)} is false{also}"


def ground(predicate: Mapping[str, str], arguments: Mapping[str, str]) -> Atom:
    """Return an atom with the values of parameters in it; ``?NAME`` for one that has no value."""
    name = predicate.get("predicate", "")
    names = fields(predicate.get("param-names", ""))
    constants = constants_of(names, fields(predicate.get("param-constants", "")))
    terms = [
        arguments.get(name, f"?{name}") if constant is None else constant
        for name, constant in zip(names, constants, strict=True)
    ]
    return ("=" if name == _EQUALITY else name, *terms)


def _likeness(one: Atom, other: Atom) -> float:
    """Return how similar the arguments of two atoms are, where at most one differs."""
    pairs = [pair for pair in zip(one, other, strict=True) if pair[0] != pair[1]]
    return likeness(*pairs[0]) if len(pairs) == 1 else 0.0
