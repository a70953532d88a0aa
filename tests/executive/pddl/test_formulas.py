"""Conditions and effects to syntax trees."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import PddlSyntaxError, parse_domain, parse_formula
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Quantified,
    TermComparison,
    Timed,
    TypedNames,
    Variable,
    When,
)
from tests.executive.pddl.texts import action, domain

P = Atom("p", (Variable("x"), Constant("k")))
Q = Atom("q", ())
TYPED = (TypedNames(("x", "y"), ("t",)), TypedNames(("z",)))


def effect(text: str) -> Formula | None:
    return parse_domain(domain(action(effect=text))).actions[0].effect


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("(p ?x k)", P),
        ("(and (p ?x k) (q))", And((P, Q))),
        ("(or (q))", Or((Q,))),
        ("(not (q))", Not(Q)),
        ("(imply (q) (p ?x k))", Imply(Q, P)),
        ("(= ?x k)", TermComparison("=", Variable("x"), Constant("k"))),
        ("(<= (f ?x) 3.5)", TermComparison("<=", FunctionTerm("f", (Variable("x"),)), Constant("3.5"))),
        ("(<= 2 water)", TermComparison("<=", Constant("2"), FunctionTerm("water", ()))),
        ("(at start (q))", Timed("at start", Q)),
        ("(over   all\n(q))", Timed("over all", Q)),
        ("(exists (?x ?y - t ?z) (q))", Quantified("exists", TYPED, Q)),
        ("()", And(())),
        ("(and)", And(())),
        # words that only start like keywords, or are keywords elsewhere, are predicates
        ("(at ?x start)", Atom("at", (Variable("x"), Constant("start")))),
        ("(at start end)", Atom("at", (Constant("start"), Constant("end")))),
        ("(exists-path ?x)", Atom("exists-path", (Variable("x"),))),
        ("(order)", Atom("order", ())),
        ("(increase ?x)", Atom("increase", (Variable("x"),))),
    ],
)  # fmt: skip
def test_conditions(text: str, formula: Formula) -> None:
    assert parse_formula(text) == formula


def test_effects() -> None:
    assert effect("(when (ready) (not (ready)))") == When(Atom("ready", ()), Not(Atom("ready", ())))
    assert effect("(increase (total-cost) (dist ?p ?p))") == NumericChange(
        "increase", FunctionTerm("total-cost", ()), FunctionTerm("dist", (Variable("p"), Variable("p")))
    )


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        ("(and dry)", 6, r"unexpected 'dry' in \(and ...\)"),
        ("", 1, "unexpected end of the condition"),
        ("(q) (q)", 5, r"unexpected '\('"),
        ("(not (q) (q))", 10, r"unexpected '\(' in \(not ...\)"),
        ("(when (q) (q))", 2, "unexpected 'when'"),
        ("(?x a)", 2, r"unexpected '\?x'"),
        ("(p ?)", 4, "this variable has no name"),
    ],
)
def test_syntax_errors(text: str, column: int, message: str) -> None:
    with pytest.raises(PddlSyntaxError, match=message) as caught:
        parse_formula(text, "f.pddl")
    assert (caught.value.file, caught.value.line, caught.value.column) == ("f.pddl", 1, column)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("(exists-path ?x)", "'exists-path' for a keyword"),
        ("(forall_done)", "for a keyword"),
        ("(AND (q))", "'AND' must be written 'and'"),
        ("(<= (f) 3)", "does not support '<='"),
        ("(imply (q) (q))", "does not support 'imply'"),
        ("(and)", "Unknown predicate: and"),
        ("(at  start (q))", "exactly one blank after 'at'"),
        ("(at\nend (q))", "exactly one blank"),
        ("()", "a formula must start with a word"),
    ],
)
def test_strict_parser_refuses_formulas_as_fawkes_does(text: str, reason: str) -> None:
    assert parse_formula(text)
    with pytest.raises(PddlSyntaxError, match="Fawkes' parser refuses this") as caught:
        parse_formula(text, fawkes_compat=True)
    assert reason in caught.value.message


@pytest.mark.parametrize(
    "text",
    ["(and (p ?x k) (not (or (q))))", "(at start (q))", "(order)", "(exists (?x) (q))", "(= ?x k)"],
)
def test_strict_parser_reads_same_formulas(text: str) -> None:
    assert parse_formula(text, fawkes_compat=True) == parse_formula(text)
