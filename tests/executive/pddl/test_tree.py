"""The tree of formulas: going through it and changing it."""

from __future__ import annotations

from cxbridge.executive.pddl import format_formula, parse_domain, parse_formula
from cxbridge.executive.pddl.ast import Constant, Term, TypedNames, Variable
from tests.executive.pddl.texts import action, domain


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
