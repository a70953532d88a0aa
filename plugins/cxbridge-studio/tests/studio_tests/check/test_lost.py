"""A finding names the rules, goals and actions that die with a construct that is dropped, for each reason."""

from __future__ import annotations

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from studio_tests.check.test_check import agent

_MAKES = """
  (assert (goal (id (gensym*)) (class VISIT)) (seen 1)
          (plan-action (id 1) (plan-id p) (goal-id g) (action-name greet) (param-values a))))
"""
_REST = """
(defrule wait (seen 1) => (assert (waited)))
(defrule waits-on (waited) => (halt))
(defrule select ?g <- (goal (class VISIT) (mode FORMULATED)) => (modify ?g (mode SELECTED)))
"""
_ALL = "lost with it: wait, waits-on, select, goals of class VISIT, the action greet"


@pytest.mark.parametrize(
    ("code", "condition"),
    [
        ("CX201", "(thing (a ?x)"),
        ("CX202", "(thng (a ?x))"),
        ("CX203", "(thing (c ?x))"),
        ("CX204", "(thing (a ?x&:(fooo ?x)))"),
        ("CX205", "(thing (a ?x)) (test (eq ?x ?*no*))"),
        ("CX206", "(thing (a ?x)) (test (sym-cat))"),
        ("CX207", "(thing (a ?x)) (test (eq ?y 1))"),
    ],
)
def test_what_dies_with_a_rule(tmp_path, code, condition):
    clips = f"(defrule first {condition} =>{_MAKES}{_REST}"
    findings = check(RunOptions(scenario=agent(tmp_path, clips)))
    first = next(each for each in findings if each.code.name == code)
    assert first.message.endswith(_ALL) or code == "CX201"
    if code == "CX201":
        assert first.message.partition("lost with it: ")[2].startswith("wait, waits-on, select")
        assert first.message.endswith("goals of class VISIT, the action greet")
    assert [each for each in findings if each.code.name.startswith("CX2")] == [first]


def test_what_dies_with_a_rule_that_another_one_replaces(tmp_path):
    clips = f"(defrule first (thing) =>{_MAKES}{_REST}(defrule first (thing) => (halt))"
    (twice, *_) = (
        each for each in check(RunOptions(scenario=agent(tmp_path, clips))) if each.code.name == "CX208"
    )
    assert twice.message.endswith(_ALL)


def test_what_dies_with_a_function_and_a_template(tmp_path):
    clips = "(deffunction two () (fooo))\n(deffunction three () (two))\n(defrule four (thing) => (three))\n"
    (one,) = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert one.message.endswith("no function 'fooo'; lost with it: three, four")
    clips = "(deftemplate box (slot a (type NONE)))\n(defrule r (box (a 1)) => (assert (filled)))\n"
    clips += "(defrule t (filled) => (halt))\n"
    (one,) = check(RunOptions(scenario=agent(tmp_path, clips)))
    assert one.message.endswith("lost with it: r, t")


def test_what_another_construct_makes_too_is_not_lost(tmp_path):
    other = f"(defrule other (thing) =>{_MAKES}"
    clips = f"(defrule first (thing (c 1)) =>{_MAKES}{other}{_REST}"
    findings = check(RunOptions(scenario=agent(tmp_path, clips)))
    (one,) = (each for each in findings if each.code.name.startswith("CX2"))
    assert one.message == "defrule first: the deftemplate 'thing' has no slot 'c'"
