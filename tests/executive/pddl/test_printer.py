"""Printed formulas and domains parse to the same values."""

from __future__ import annotations

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.executive.pddl import format_domain, format_formula, parse_formula
from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Constant,
    Declaration,
    Domain,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Quantified,
    TermComparison,
    Timed,
    TypedList,
    TypedNames,
    Variable,
    When,
)
from cxbridge.executive.pddl.build import SyntaxBuilder
from cxbridge.executive.pddl.reader import Reader
from cxbridge.executive.pddl.tokens import SourceText

patient = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])

KEYWORDS = {"and", "or", "not", "imply", "exists", "forall", "when", "increase", "decrease", "assign"}
NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,5}", fullmatch=True).filter(lambda name: name not in KEYWORDS)
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
ATOMS = st.builds(Atom, NAMES, st.lists(TERMS, max_size=3).map(tuple))
COMPARISONS = st.builds(TermComparison, st.sampled_from(["=", "<", ">", "<=", ">="]), NUMBERS, NUMBERS)
TYPES = st.lists(NAMES, max_size=2).map(tuple)


def regroup(groups: list[TypedNames]) -> TypedList:
    """Only the last group may be untyped: earlier untyped names would get the next group's type."""
    return tuple(g if g.types or g is groups[-1] else TypedNames(g.names, ("t",)) for g in groups)


NAME_LISTS = st.lists(NAMES, min_size=1, max_size=3).map(tuple)
TYPED = st.lists(st.builds(TypedNames, NAME_LISTS, TYPES), max_size=3).map(regroup)
SOME_TYPED = st.lists(st.builds(TypedNames, NAME_LISTS, TYPES), min_size=1, max_size=2).map(regroup)


def formulas(leaves: st.SearchStrategy[Formula], *, effects: bool) -> st.SearchStrategy[Formula]:
    def extend(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        parts = st.lists(inner, max_size=3).map(tuple)
        extended: st.SearchStrategy[Formula] = st.one_of(
            st.builds(And, parts),
            st.builds(Or, parts),
            st.builds(Not, inner),
            st.builds(Imply, inner, inner),
            st.builds(Timed, st.sampled_from(["at start", "at end", "over all"]), inner),
            st.builds(Quantified, st.sampled_from(["exists", "forall"]), SOME_TYPED, inner),
        )
        return extended | st.builds(When, CONDITIONS, inner) if effects else extended

    return st.recursive(leaves, extend, max_leaves=6)


CONDITIONS: st.SearchStrategy[Formula] = formulas(ATOMS | COMPARISONS, effects=False)
CHANGES = st.builds(NumericChange, st.sampled_from(["increase", "assign", "scale-up"]), NUMBERS, NUMBERS)
EFFECTS: st.SearchStrategy[Formula] = formulas(ATOMS | CHANGES, effects=True)
ACTIONS = st.builds(
    ActionSchema,
    NAMES,
    TYPED,
    st.none() | CONDITIONS,
    st.none() | EFFECTS,
    st.booleans(),
    st.none() | COMPARISONS,
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


@patient
@given(CONDITIONS)
def test_printed_conditions_are_read_back(formula: Formula) -> None:
    assert parse_formula(format_formula(formula)) == formula


@patient
@given(DOMAINS)
def test_printed_domains_are_read_back(domain: Domain) -> None:
    # Not checked: a generated domain parses, but seldom makes sense.
    text = SourceText(format_domain(domain))
    assert Reader(SyntaxBuilder.handler).read(text.tokens, "domain", SyntaxBuilder(text)) == domain
