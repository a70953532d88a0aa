"""Temporal properties of patterns in runs of the test scenario."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import ConfigError
from cxbridge_explore.properties.forms import read_property
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.worlds.points import Step
from explore_tests.properties.runs import shipped_options, watch_run

TALK = shipped_options("test-scenario")
HELLO = "Skiller: say{text='Hello peggy', wait=True}"


GOAL = "(goal (class TALK) {})"
COMPLETED = GOAL.format("(outcome COMPLETED)")
DISPATCHED_THEN = "after (goal (id ?g) (class TALK) (mode DISPATCHED)) then (goal (id ?g) (mode FINISHED))"
# CLIPS evaluates the patterns after a new `not` too early, which a probe must not see
ABSENT = "(forall (domain-operator (name ?n&print)) (skill-action-mapping (name ?n)))"


def watch_property(text: str, *, fails: bool = False) -> PropertyWatch:
    return watch_run(TALK, [read_property(text)], {0: Step(HELLO, "fails")} if fails else {})


@pytest.mark.parametrize(
    "text",
    [
        "never (goal (class TALK) (outcome FAILED) (id ?g))",
        "never (plan) (not (goal))",  # for a moment between two rules
        f"never {ABSENT}",
        "always (domain-operator (name say-hello))",
        "always (skiller-control)",  # a modified fact is absent for a moment
        "always (forall (domain-operator (name ?n)) (domain-operator (name ?n)))",
        f"eventually {COMPLETED}",
        f"eventually {COMPLETED} within 30",
        DISPATCHED_THEN,
        "after (goal (class PRINT) (mode DISPATCHED)) then (domain-loaded)",  # matches already
    ],
)
def test_property_holds(text: str):
    assert watch_property(text).violations == []


@pytest.mark.parametrize(
    ("text", "fails", "message", "after_s"),
    [
        ("never (goal (class TALK) (outcome FAILED) (id ?g))", True, r".* matches: \?g = gen", 0),
        ("never (goal (class TALK) (mode FINISHED))", False, ".* matches", 0),  # only between two rules
        (
            f"never {GOAL.format('')} (not (domain-fact (name said) (param-values peggy hello)))",
            False,
            ".* matches",
            0,
        ),
        (
            "never (and (goal (id ?g)) (not (plan (goal-id ?g) (id ?p))))",
            False,
            r".* matches: \?g = \S+$",
            0,
        ),
        (f"always (not {GOAL.format('(mode DISPATCHED)')})", False, ".* does not match", 0.03),
        (f"always {ABSENT}", False, ".* does not match", 0),
        (f"eventually {COMPLETED}", True, r".* has never matched$", 0),
        (f"eventually {COMPLETED} within 2", False, ".* has not matched within 2 s$", 2),
        (f"eventually {COMPLETED} within 0.5", False, ".* has not matched within 0.5 s$", 0.5),
        (f"{DISPATCHED_THEN} within 3", False, r".* has not matched within 3 s, after .*: \?g = gen", 3),
    ],
)
def test_property_is_violated(text: str, fails: bool, message: str, after_s: float):
    (violation,) = watch_property(text, fails=fails).violations
    assert re.match(message, violation.message)
    assert violation.seconds >= after_s


def test_property_without_occasion_is_not_evaluated():
    assert (
        watch_property("after (goal (class TALK) (outcome REJECTED)) then (goal)").evaluated_names
        == frozenset()
    )
    assert watch_property("never (plan-action)").evaluated_names


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
def test_invalid_property_is_error(text: str, error: str):
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
def test_unknown_name_in_property_is_error(text: str, error: str):
    with pytest.raises(ConfigError, match=error):
        watch_property(text)
