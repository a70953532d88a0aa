"""Formulas made from the facts of an environment that describe conditions.

The feature ``pddl-parser`` asserts the facts: ``pddl-formula`` for each formula, and ``pddl-predicate`` for
the content of an atom. Their slot ``part-of`` has the id of the parent, an operator or another formula.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.values import constants_of
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    Not,
    Or,
    Term,
    TermComparison,
    Variable,
)
from cxbridge.executive.pddl.facts import EQUALITY_PREDICATE

if TYPE_CHECKING:
    from cxbridge.executive.host.values import Value

_EQUALITY_TERM_COUNT: Final = 2
# The maximum number of ids above a parent whose formulas are read; deeper formulas are left out. The
# recursion needs a bound, because agents assert such facts, too.
_MAX_ANCESTOR_COUNT: Final = 50

Slots = Mapping[str, "Value"]


class FormulaMaker:
    """Makes formulas from facts.

    :param formulas: the facts ``pddl-formula``.
    :param atoms: the facts ``pddl-predicate``.
    """

    def __init__(self, formulas: Iterable[Slots], atoms: Iterable[Slots]) -> None:
        # only the last fact of an id counts: N formulas with two parents each would be visited 2^N times
        self._formulas: dict[str, list[Slots]] = {}
        for slots in {slot_text(slots, "id"): slots for slots in formulas}.values():
            self._formulas.setdefault(slot_text(slots, "part-of"), []).append(slots)
        self._atoms: dict[str, list[Slots]] = {}
        for slots in atoms:
            self._atoms.setdefault(slot_text(slots, "part-of"), []).append(slots)

    def operator_condition(self, operator: str) -> Formula | None:
        """Return the condition of an operator; None without a condition."""
        parts = self._parts_of(operator, ())
        return parts[0] if len(parts) == 1 else And(tuple(parts)) if parts else None

    def _parts_of(self, parent: str, ancestors: tuple[str, ...]) -> list[Formula]:
        """Return the formulas and atoms that are part of a parent.

        :param ancestors: the ids above the parent, to end cycles and to limit the depth.
        """
        atoms = [make_atom(slots) for slots in self._atoms.get(parent, ())]
        if parent in ancestors or len(ancestors) > _MAX_ANCESTOR_COUNT:
            return atoms
        inner_ancestors = (*ancestors, parent)
        return [
            *atoms,
            *(self._make_formula(slots, inner_ancestors) for slots in self._formulas.get(parent, ())),
        ]

    def _make_formula(self, slots: Slots, ancestors: tuple[str, ...]) -> Formula:
        parts, kind = self._parts_of(slot_text(slots, "id"), ancestors), slot_text(slots, "type")
        if kind == "negation" and parts:
            return Not(parts[0] if len(parts) == 1 else And(tuple(parts)))
        if kind == "disjunction":
            return Or(tuple(parts))
        return parts[0] if kind == "atom" and parts else And(tuple(parts))


def make_atom(slots: Slots) -> Formula:
    """Return the atom or equality of a fact ``pddl-predicate`` or ``domain-effect``."""
    names, constants = slot_texts(slots, "param-names"), slot_texts(slots, "param-constants")
    terms: list[Term] = [
        Variable(name) if constant is None else Constant(constant)
        for name, constant in zip(names, constants_of(names, constants), strict=True)
    ]
    predicate = slot_text(slots, "predicate")
    if predicate == EQUALITY_PREDICATE and len(terms) == _EQUALITY_TERM_COUNT:
        return TermComparison("=", terms[0], terms[1])
    return Atom(predicate, tuple(terms))


def slot_text(slots: Slots, name: str) -> str:
    """Return the value of a slot as text; empty without the slot."""
    return str(slots.get(name, ""))


def slot_texts(slots: Slots, name: str) -> list[str]:
    """Return the values of a multislot as texts; empty without the slot, and for a single value."""
    values = slots.get(name, ())
    return [str(value) for value in values] if isinstance(values, tuple) else []
