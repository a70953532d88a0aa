"""`modify` as CLIPS 6.30 does it."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import FALSE, Symbol

TEMPLATE = "(deftemplate item (slot id) (slot mode) (slot n (type FLOAT)) (multislot tags (type STRING)))"


@pytest.fixture
def items(env):
    env.build(TEMPLATE)
    return env


def slots(env):
    return [(index, values) for index, _, values in env.facts("item")]


def test_a_modified_fact_has_a_new_index(items):
    items.assert_string("(item (id a))")
    items.eval("(cx-modify 1 mode (create$ X))")
    ((index, values),) = slots(items)
    assert index == 2
    assert values["mode"] == "X"
    assert values["id"] == "a"


def test_a_modify_that_changes_nothing_fires_rules_again(items, clp):
    items.load(clp("(defrule once ?f <- (item (id a) (mode X)) => (assert (seen (fact-index ?f))))"))
    items.assert_string("(item (id a) (mode X))")
    items.run()
    items.eval("(cx-modify 1 mode (create$ X))")
    assert items.run() == 1
    assert [values["implied"] for _, _, values in items.facts("seen")] == [(1,), (3,)]


def test_the_old_values_are_read_before_the_fact_goes(items, clp):
    items.load(
        clp(
            """(defrule swap ?f <- (item (id ?i) (mode ?m&~done))
                 => (modify ?f (id ?m) (mode done) (tags (str-cat (fact-slot-value ?f id)))))"""
        )
    )
    items.assert_string("(item (id left) (mode right))")
    items.run()
    ((_, values),) = slots(items)
    assert (values["id"], values["mode"], values["tags"]) == ("right", "done", ("left",))


def test_exists_sees_the_fact_gone_in_between(items, clp):
    """In 6.30 a rule on `exists` fires again when the only matching fact is modified."""
    items.load(clp("(defrule any (exists (item (mode X|Y))) => (assert (fired (gensym*))))"))
    items.assert_string("(item (id a) (mode X))")
    items.run()
    items.eval("(cx-modify 1 mode (create$ Y))")
    assert items.run() == 1


def test_values_of_other_types_than_declared_are_stored_as_in_clips(items):
    """Regression: a builder refused the integer 0 for a FLOAT slot, and goal trees were not built."""
    items.assert_string("(item (id a))")
    items.eval("(cx-modify 1 n (create$ 7) tags (create$ sym 1))")
    ((_, values),) = slots(items)
    assert values["n"] == 7
    assert values["tags"] == (Symbol("sym"), 1)


def test_a_fact_that_is_not_there_is_reported_and_the_rule_goes_on(items, log):
    """As in CLIPS 6.30; 6.4 ends the rule."""
    assert items.eval("(cx-modify 99 mode (create$ X))") == FALSE
    assert any("Unable to find fact f-99." in text for text in log.texts())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            "(cx-modify 1 nope (create$ X))",
            "Invalid slot 'nope' not defined in corresponding deftemplate 'item'.",
        ),
        (
            "(cx-modify 1 mode (create$ X Y))",
            "The single field slot 'mode' can only contain a single field value.",
        ),
        ('(cx-modify "f" mode (create$ X))', "expected a fact-address or fact-index"),
    ],
)
def test_what_cannot_be_done_is_told(items, log, call, message):
    items.assert_string("(item (id a) (mode M))")
    with pytest.raises(Exception, match="cannot evaluate"):
        items.eval(call)
    assert any(message in text for text in log.texts())
    assert [values["mode"] for _, values in slots(items)] == ["M"]


def test_a_retracted_fact_cannot_be_modified(items, clp, log):
    items.load(clp("(defrule r ?f <- (item) => (retract ?f) (modify ?f (mode X)))"))
    items.assert_string("(item (id a))")
    items.run()
    assert any("has been retracted" in text for text in log.texts())
    assert slots(items) == []


def test_many_modifies_leave_nothing_behind(items, clp):
    items.load(
        clp('(defrule count ?f <- (item (n ?n&:(< ?n 5000.0))) => (modify ?f (n (+ ?n 1.0)) (tags "a" "b")))')
    )
    items.assert_string("(item (id a) (n 0.0))")
    assert items.run() == 5000
    ((_, values),) = slots(items)
    assert values["n"] == 5000.0
