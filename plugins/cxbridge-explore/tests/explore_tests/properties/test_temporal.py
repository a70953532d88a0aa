"""Properties of patterns over time, matched by CLIPS in runs of the test scenario."""

from __future__ import annotations

import pytest

from cxbridge.errors import ConfigError
from cxbridge_explore.properties.forms import read_property
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.worlds.points import Step
from explore_tests.properties.runs import shipped, watched

TALK = shipped("test-scenario")
HELLO = "Skiller: say{text='Hello peggy', wait=True}"


def run_of(text: str, *, fails: bool = False) -> PropertyWatch:
    return watched(TALK, [read_property(text)], {0: Step(HELLO, "fails")} if fails else {})


def message(run: PropertyWatch) -> str:
    (violation,) = run.violations
    return violation.message


def test_never():
    text = "never (goal (class TALK) (outcome FAILED) (id ?g))"
    assert run_of(text).violations == []
    assert message(run_of(text, fails=True)).startswith(
        "(goal (class TALK) (outcome FAILED) (id ?g)) matches: ?g = gen"
    )


def test_never_sees_what_is_there_between_two_rules_only():
    assert message(run_of("never (goal (class TALK) (mode FINISHED))"))


def test_never_with_an_absence_is_looked_at_after_each_loop():
    assert run_of("never (plan) (not (goal))").violations == []
    assert message(
        run_of("never (goal (class TALK)) (not (domain-fact (name said) (param-values peggy hello)))")
    )


def test_always():
    assert run_of("always (domain-operator (name say-hello))").violations == []
    violation = run_of("always (not (goal (class TALK) (mode DISPATCHED)))").violations[0]
    assert "does not match" in violation.message
    assert violation.seconds > 0.03


def test_always_bears_a_fact_that_is_modified():
    assert run_of("always (skiller-control)").violations == []


def test_eventually():
    assert run_of("eventually (goal (class TALK) (outcome COMPLETED))").violations == []
    assert message(run_of("eventually (goal (class TALK) (outcome COMPLETED))", fails=True)) == (
        "(goal (class TALK) (outcome COMPLETED)) has never matched"
    )


def test_eventually_within():
    text = "eventually (goal (class TALK) (outcome COMPLETED)) within {}"
    assert run_of(text.format(30)).violations == []
    late = run_of(text.format(2)).violations[0]
    assert late.message.endswith("has not matched within 2 s")
    assert 2 < late.seconds < 2.1


def test_after_then():
    text = "after (goal (id ?g) (class TALK) (mode DISPATCHED)) then (goal (id ?g) (mode FINISHED))"
    assert run_of(text).violations == []
    late = run_of(f"{text} within 3").violations[0]
    assert "has not matched within 3 s" in late.message
    assert "?g = gen" in late.message


def test_after_then_with_what_stands_already():
    assert run_of("after (goal (class PRINT) (mode DISPATCHED)) then (domain-loaded)").violations == []


def test_what_never_had_an_occasion_is_vacuous():
    assert run_of("after (goal (class TALK) (outcome REJECTED)) then (goal)").evaluated_names == frozenset()
    assert run_of("never (plan-action)").evaluated_names


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("nevr (goal)", "did you mean never"),
        ("never goal", "needs a pattern"),
        ("never (test (> 1 0))", "needs a pattern"),
        ("never (goal) within 3", "cannot have a time limit"),
        ("eventually (goal) within soon", "must be followed by seconds"),
        ("eventually (goal) within -1", "must be followed by seconds"),
        ("eventually (goal) witin 3", "did you mean within"),
        ("after (goal) (plan)", "needs a 'then'"),
        ("never (goal", "parentheses"),
        ("", "must begin with"),
    ],
)
def test_a_form_that_is_wrong(text: str, error: str):
    with pytest.raises(ConfigError, match=error):
        read_property(text)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("never (gaol (mode FAILED))", "did you mean goal"),
        ("never (goal (mod FAILED))", "Invalid slot 'mod'"),
        ("never (goal (mode FAILED))", r"hint: \[CSTRNCHK1\] A literal restriction value does not match"),
    ],
)
def test_a_name_that_the_agent_lacks(text: str, error: str):
    with pytest.raises(ConfigError, match=error):
        run_of(text)


def test_a_condition_of_several_facts_that_are_not_there():
    """CLIPS evaluates what follows a new `not` too early: a probe must not see that."""
    operators = "(forall (domain-operator (name ?n&print)) (skill-action-mapping (name ?n)))"
    assert "does not match" in message(run_of(f"always {operators}"))
    assert run_of(f"never {operators}").violations == []
    assert run_of("always (forall (domain-operator (name ?n)) (domain-operator (name ?n)))").violations == []
