"""The search for rules that set a slot."""

from __future__ import annotations

import pytest

from cxbridge_studio.explain.waiting_rules import find_setting_rules

RULES = {
    "modifies the fact of its pattern": "?r <- (robot (goal ?)) => (modify ?r (goal nil))",
    "modifies the fact of a pattern in a group": "(or (and ?r <- (robot) (x)) (y)) => (modify ?r (goal nil))",
    "modifies the fact of a query": "(x) => (do-for-fact ((?r robot)) TRUE (modify ?r (goal nil)))",
    "duplicates": "?r <- (robot (goal ?)) => (duplicate ?r (goal nil))",
    "asserts": "(x) => (assert (robot (goal nil)))",
    "asserts under a condition": "(x ?n) => (if (> ?n 1) then (assert (robot (goal nil))))",
}
OTHER_RULES = {
    "modifies a fact of another template": "(robot) ?t <- (task (goal ?)) => (modify ?t (goal nil))",
    "modifies another slot": "?r <- (robot (goal ?)) => (modify ?r (name nil))",
    "matches only": "(robot (goal nil)) => (assert (x))",
    "sets another value": "?r <- (robot (goal ?)) => (modify ?r (goal other))",
}


@pytest.mark.parametrize("name", RULES)
def test_rule_that_sets_slot_is_found(name):
    assert find_setting_rules({"a": f"(defrule a {RULES[name]})"}, "robot", "goal", ["nil"]) == ["a"]


@pytest.mark.parametrize("name", OTHER_RULES)
def test_rule_that_does_not_set_slot_is_not_found(name):
    assert find_setting_rules({"a": f"(defrule a {OTHER_RULES[name]})"}, "robot", "goal", ["nil"]) == []


def test_rule_with_unknown_value_is_found_without_better_rule():
    texts = {"a": "(defrule a ?r <- (robot) (x ?n) => (modify ?r (goal ?n)))"}
    assert find_setting_rules(texts, "robot", "goal", ["nil"]) == ["a"]
    texts["b"] = "(defrule b ?r <- (robot) => (modify ?r (goal nil)))"
    assert find_setting_rules(texts, "robot", "goal", ["nil"]) == ["b"]
