"""Printed formulas and domains parse to the same values."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import (
    format_domain,
    format_formula,
    formula_facts,
    parse_formula,
)
from cxbridge.executive.pddl.ast import (
    FORMULA_CLASSES,
    FORMULA_WORDS,
    ActionSchema,
    And,
    Atom,
    Constant,
    Declaration,
    Domain,
    Formula,
    FormulaNode,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Quantified,
    TermComparison,
    TypedList,
    TypedNames,
    Variable,
    When,
)
from cxbridge.executive.pddl.build import SyntaxBuilder
from cxbridge.executive.pddl.reader import Reader, UnexpectedToken
from cxbridge.executive.pddl.tokens import SourceText
from cxbridge.executive.pddl.unsupported import unsupported_formula
from cxbridge.executive.problem.truth import KnownState

patient = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])

NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,5}", fullmatch=True).filter(lambda name: name not in FORMULA_WORDS)
VARIABLES = NAMES.map(Variable)
CONSTANTS = (NAMES | st.sampled_from(["3", "-1.5", "start"])).map(Constant)
TERMS = st.recursive(
    VARIABLES | CONSTANTS,
    lambda inner: st.builds(FunctionTerm, NAMES, st.lists(inner, max_size=2).map(tuple)),
    max_leaves=3,
)
# a word in place of a number is a function
NUMBERS = (
    VARIABLES
    | st.sampled_from(["3", "-1.5"]).map(Constant)
    | st.builds(FunctionTerm, NAMES, st.lists(TERMS, max_size=2).map(tuple))
)
TYPES = st.lists(NAMES, max_size=2).map(tuple)


def regroup(groups: list[TypedNames]) -> TypedList:
    """Only the last group may be untyped: earlier untyped names would get the next group's type."""
    return tuple(g if g.types or g is groups[-1] else TypedNames(g.names, ("t",)) for g in groups)


NAME_LISTS = st.lists(NAMES, min_size=1, max_size=3).map(tuple)
TYPED = st.lists(st.builds(TypedNames, NAME_LISTS, TYPES), max_size=3).map(regroup)
SOME_TYPED = st.lists(st.builds(TypedNames, NAME_LISTS, TYPES), min_size=1, max_size=2).map(regroup)


def formulas(kind: Any, parts: st.SearchStrategy[Formula]) -> st.SearchStrategy[Any]:
    """Return formulas of a kind, by the types of the fields of its class."""
    strategies: dict[str, st.SearchStrategy[Any]] = {
        "Formula": parts,
        "tuple[Formula, ...]": st.lists(parts, max_size=3).map(tuple),
        "Term": NUMBERS,
        "tuple[Term, ...]": st.lists(TERMS, max_size=3).map(tuple),
        "TypedList": SOME_TYPED,
        "str": st.sampled_from(kind.KIND.words) if kind.KIND.words else NAMES,
    }
    fields = {name: strategies[type_] for name, type_ in field_types(kind).items()}
    return st.builds(kind, **({**fields, "condition": CONDITIONS} if kind is When else fields))


def field_types(kind: Any) -> dict[str, str]:
    return {name: kind.__annotations__[name] for name in kind.__struct_fields__ if name != "position"}


def nested_formulas(kinds: Iterable[Any]) -> st.SearchStrategy[Formula]:
    leaves = [formulas(kind, st.nothing()) for kind in kinds if not kind.KIND.parts]
    inner_kinds = [kind for kind in kinds if kind.KIND.parts]
    return st.recursive(
        st.one_of(leaves),
        lambda parts: st.one_of([formulas(kind, parts) for kind in inner_kinds]),
        max_leaves=6,
    )


CONDITIONS = nested_formulas({*FORMULA_CLASSES} - {When, NumericChange})
# the grammar reads these conditions in effects, too
EFFECTS = nested_formulas(
    [Atom, And, Or, Not, Imply, TermComparison, Quantified]
    + [node for node in FORMULA_CLASSES if not node.KIND.is_condition]
)
ACTIONS = st.builds(
    ActionSchema,
    NAMES,
    TYPED,
    st.none() | CONDITIONS,
    st.none() | EFFECTS,
    st.booleans(),
    st.none() | CONDITIONS,
)
DOMAINS = st.builds(
    Domain,
    name=NAMES,
    requirements=st.lists(NAMES, max_size=3).map(tuple),
    types=TYPED,
    constants=TYPED,
    predicates=st.lists(st.builds(Declaration, NAMES, TYPED), max_size=3).map(tuple),
    functions=st.lists(st.builds(Declaration, NAMES, TYPED), max_size=2).map(tuple),
    actions=st.lists(ACTIONS, max_size=2).map(tuple),
)


def is_read_back(domain: Domain) -> bool:
    # Not checked: a generated domain parses, but seldom makes sense.
    text = SourceText(format_domain(domain))
    try:
        return bool(Reader(SyntaxBuilder.handler).read(text.tokens, "domain", SyntaxBuilder(text)) == domain)
    except UnexpectedToken:
        return False


@pytest.mark.parametrize("kind", FormulaNode.__subclasses__())
@settings(patient, max_examples=8)
@given(data=st.data())
def test_each_kind_of_formula_is_complete(kind: Any, data: st.DataObject) -> None:
    """The grammar reads the words of the kind, readers of formulas handle it, words are names elsewhere."""
    assert kind in FORMULA_CLASSES
    assert {*kind.KIND.parts, *kind.KIND.terms} == {
        name for name, type_ in field_types(kind).items() if re.search("Formula|Term", type_)
    }
    formula = data.draw(formulas(kind, st.builds(Atom, NAMES, st.just(()))))
    assert any(
        is_read_back(Domain("d", actions=(action,)))
        for action in (ActionSchema("a", condition=formula), ActionSchema("a", effect=formula))
    )
    assert formula.holds(KnownState((), {})) in (True, False)
    with suppress(PddlError):  # a kind without facts is refused
        assert formula_facts(formula, "op")
    for word in filter(str.isalpha, kind.KIND.words):
        assert parse_formula(f"(p {word})") == Atom("p", (Constant(word),))
        assert not unsupported_formula(word)


@patient
@given(CONDITIONS)
def test_printed_conditions_are_read_back(formula: Formula) -> None:
    assert parse_formula(format_formula(formula)) == formula


@patient
@given(DOMAINS)
def test_printed_domains_are_read_back(domain: Domain) -> None:
    assert is_read_back(domain)
