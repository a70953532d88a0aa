"""The tree of formulas: going through it and changing it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import format_formula, formula_facts, parse_domain, parse_formula
from cxbridge.executive.pddl.ast import (
    FORMULA_KINDS,
    Atom,
    Constant,
    Formula,
    FormulaNode,
    FunctionTerm,
    Term,
    TypedNames,
    Variable,
)
from cxbridge.executive.pddl.unsupported import unsupported_formula
from cxbridge.executive.problem.truth import KnownState
from tests.executive.pddl.texts import action, domain

VALUES: dict[str, object] = {
    "Formula": Atom("p", ()),
    "tuple[Formula, ...]": (Atom("p", ()), Atom("q", ())),
    "Term": FunctionTerm("f", ()),
    "tuple[Term, ...]": (Variable("x"),),
    "TypedList": (TypedNames(("x",)),),
}
"""The values of the fields of formulas by their types; fields of other types hold the first word."""


def read_back(text: str) -> Iterator[Formula | None]:
    for part in ("condition", "effect"):
        with suppress(PddlError):
            parts = action(**{part: text}, parameters="?x - robot")
            read = parse_domain(
                domain(parts, predicates="(ready) (p) (q) (r ?x)", functions="(:functions (f))")
            )
            yield getattr(read.actions[0], part)


@pytest.mark.parametrize(
    ("kind", "word"),
    [(kind, word) for kind in FormulaNode.__subclasses__() for word in kind.KIND.words or ["r"]],
)
def test_each_kind_of_formula_is_complete(kind: Any, word: str) -> None:
    assert kind in FORMULA_KINDS
    types = {name: kind.__annotations__[name] for name in kind.__struct_fields__ if name != "position"}
    values = {name: VALUES.get(type_, word) for name, type_ in types.items()}
    assert {name for name in types if re.search("Formula|Term", types[name])} == {
        *kind.KIND.parts,
        *kind.KIND.terms,
    }
    formula = kind(**values)
    assert formula in read_back(format_formula(formula))
    assert formula.holds(KnownState({("p", ()), ("q", ())}, {})) in (True, False)
    with suppress(PddlError):  # a kind without facts is refused
        assert formula_facts(formula, "op")
    assert not unsupported_formula(word)
    assert not word.isalpha() or parse_formula(f"(r {word})") == Atom("r", (Constant(word),))


def test_walk_yields_each_formula_before_its_parts() -> None:
    formula = parse_formula("(imply (not (a)) (forall (?x) (or (b ?x) (= ?x k))))")
    texts = [format_formula(part) for part in formula.walk()]
    assert texts[1:4] == ["(not (a))", "(a)", "(forall (?x) (or (b ?x) (= ?x k)))"]
    assert texts[5:] == ["(b ?x)", "(= ?x k)"]


def test_map_terms_reaches_terms_within_terms() -> None:
    text = domain(action(effect="(when (at ?r ?p) (increase (total-cost) (* 2 (dist ?p home))))"))
    effect = parse_domain(text).actions[0].effect
    assert effect is not None

    def bound(term: Term) -> Term:
        return Constant(f"my-{term.name}") if isinstance(term, Variable) else term

    wanted = "(when (at my-r my-p) (increase (total-cost) (* 2 (dist my-p home))))"
    assert format_formula(effect.map_terms(bound)) == wanted


def test_map_terms_keeps_positions() -> None:
    formula = parse_formula("(and\n (p ?x))")
    changed = formula.map_terms(lambda _term: Constant("k"))
    assert [part.position for part in changed.walk()] == [(1, 1), (2, 2)]
    assert TypedNames(("x",)) not in changed.children
