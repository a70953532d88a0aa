"""The values of printed facts."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.clipstext.values import FactRef
from cxbridge.events import FactChange
from cxbridge.executive.host.facts.copying import FactTemplate
from cxbridge.executive.host.values import Symbol
from cxbridge_studio.explain.rules.environment import take_snapshot
from cxbridge_studio.explain.rules.recorded_facts import parse_rows
from cxbridge_studio.explain.slot_values import parse_values
from studio_tests.explain.worlds import make_world
from tests.support import many

WORDS = st.text("abcXYZ-_09/ ", max_size=8)
VALUES = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from([0.5, -1.25, 1e30, 3.0]),
    WORDS,
    st.sampled_from(["nil", "S_RUNNING", "a-b", "?x", "+", "-", "1-2", "e5"]).map(Symbol),
)


@settings(max_examples=many(100, 25), deadline=None)
@given(st.lists(st.tuples(VALUES, st.lists(VALUES, max_size=4)), min_size=1, max_size=5))
def test_printed_facts_are_parsed_to_equal_values(contents):
    with make_world("(deftemplate t (slot a) (multislot b))", "(defrule it (t) (o $?) =>)") as env:
        for value, values in contents:
            env.assert_fact("t", {"a": value, "b": tuple(values)})
            env.assert_ordered("o", (value, *values))
        snapshot = take_snapshot(env, "it")
        changes = [
            FactChange(
                0,
                "world",
                True,
                row.index,
                row.template,
                env.watcher.fact_text(env.maker.find_fact(row.index)),
            )
            for row in snapshot.facts
        ]
    templates, rows = parse_rows(changes, snapshot.templates)
    assert templates == snapshot.templates
    assert tuple(rows) == snapshot.facts


def make_change(index: int, text: str) -> FactChange:
    """Return the assertion of a fact with the template of the text."""
    return FactChange(0, "e", True, index, text[1:].split(" ", maxsplit=1)[0].rstrip(")"), text)


def test_unknown_templates_are_derived_from_facts():
    changes = [
        make_change(1, "(t (a 1) (b x y))"),
        make_change(2, "(t (a 2) (b z))"),
        make_change(3, "(o 1 2)"),
        make_change(4, "(p)"),
    ]
    templates, rows = parse_rows(changes, {})
    assert templates["t"] == FactTemplate("t", (("a", False), ("b", True)))
    assert templates["o"].slots is None
    assert [row.values for row in rows] == [
        (1, (Symbol("x"), Symbol("y"))),
        (2, (Symbol("z"),)),
        ((1, 2),),
        ((),),
    ]


def test_fact_address_is_parsed():
    assert parse_values("<Fact-12>") == (FactRef(12),)


def test_truncated_fact_is_omitted():
    known = {"t": FactTemplate("t", (("a", False),))}
    assert parse_rows([make_change(1, "(t (a 1"), make_change(2, "(t (a 2))")], known)[1][0].index == 2
