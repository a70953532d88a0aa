"""`modify` behaves as in CLIPS 6.30."""

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


def test_modified_fact_has_new_index(items):
    items.assert_string("(item (id a))")
    items.eval("(cx-modify 1 mode (create$ X))")
    ((index, values),) = slots(items)
    assert index == 2
    assert values["mode"] == "X"
    assert values["id"] == "a"


def test_modify_without_change_fires_rules_again(items, clp):
    items.load(clp("(defrule once ?f <- (item (id a) (mode X)) => (assert (seen (fact-index ?f))))"))
    items.assert_string("(item (id a) (mode X))")
    items.run()
    items.eval("(cx-modify 1 mode (create$ X))")
    assert items.run() == 1
    assert [values["implied"] for _, _, values in items.facts("seen")] == [(1,), (3,)]


def test_modify_reads_old_values_before_retraction(items, clp):
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


def test_exists_sees_retraction_within_modify(items, clp):
    """In 6.30 a rule on `exists` fires again when the only matching fact is modified."""
    items.load(clp("(defrule any (exists (item (mode X|Y))) => (assert (fired (gensym*))))"))
    items.assert_string("(item (id a) (mode X))")
    items.run()
    items.eval("(cx-modify 1 mode (create$ Y))")
    assert items.run() == 1


def test_values_of_undeclared_types_are_stored_as_in_clips(items):
    """Regression: a builder refused the integer 0 for a FLOAT slot, and goal trees were not built."""
    items.assert_string("(item (id a))")
    items.eval("(cx-modify 1 n (create$ 7) tags (create$ sym 1))")
    ((_, values),) = slots(items)
    assert values["n"] == 7
    assert values["tags"] == (Symbol("sym"), 1)


def test_modify_of_missing_fact_is_reported_without_abort(items, log):
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
def test_invalid_modify_is_reported(items, log, call, message):
    items.assert_string("(item (id a) (mode M))")
    with pytest.raises(Exception, match="cannot evaluate"):
        items.eval(call)
    assert any(message in text for text in log.texts())
    assert [values["mode"] for _, values in slots(items)] == ["M"]


def test_modify_of_retracted_fact_is_reported(items, clp, log):
    items.load(clp("(defrule r ?f <- (item) => (retract ?f) (modify ?f (mode X)))"))
    items.assert_string("(item (id a))")
    items.run()
    assert any("has been retracted" in text for text in log.texts())
    assert slots(items) == []


def test_many_modifies_leak_no_memory(items, clp):
    items.load(
        clp('(defrule count ?f <- (item (n ?n&:(< ?n 5000.0))) => (modify ?f (n (+ ?n 1.0)) (tags "a" "b")))')
    )
    items.assert_string("(item (id a) (n 0.0))")
    assert items.run() == 5000
    ((_, values),) = slots(items)
    assert values["n"] == 5000.0
