"""Suggestions for unknown names."""

from __future__ import annotations

import pytest

from cxbridge.suggestions import bracketed_suggestion, did_you_mean, likeness, nearest_names


@pytest.mark.parametrize(
    ("name", "known", "wanted"),
    [
        ("pik", ["pick", "place", "move"], ["pick"]),
        ("TALK", ["talk", "walk"], ["talk"]),  # upper case, as goal classes are
        ("talkgoal", ["TALK-GOAL", "WALK"], ["TALK-GOAL"]),
        ("mov", ["move", "move-to-the-station"], ["move"]),  # much less similar names are left out
        ("mini.clp", ["init.clp", "mimi.clp", "domain.clp"], ["mimi.clp", "init.clp"]),
        ("rule-c", ["rule-a", "rule-b", "rule-d", "rule-e"], ["rule-e", "rule-d", "rule-b"]),
        ("select", ["goal-reasoner-select-root", "goal-expand"], ["goal-reasoner-select-root"]),
        ("domian.pddl", ["domain.pddl", "problem.pddl"], ["domain.pddl"]),
        ("MotrInterface", ["LedInterface", "MotorInterface"], ["MotorInterface"]),
        ("SkillerInterfaces", ["SkillerInterface", "LedInterface"], ["SkillerInterface"]),
        ("planer-plan", ["planner-plan", "plan-action"], ["planner-plan"]),
        ("planer", ["planner", "pddl-parser"], ["planner"]),
        ("bok", ["book", "object", "shelf"], ["book"]),
        (":precondtion", [":precondition", ":condition", ":effect"], [":precondition"]),
        ("sim", ["lua", "simulator", "none"], ["simulator"]),
        ("xy", ["goal-xy-root"], []),  # too short to be a part of names by intent
        ("zebra", ["goal", "plan"], []),
        ("", ["goal"], []),
        ("goal", [], []),
    ],
)
def test_nearest_names(name, known, wanted):
    assert nearest_names(name, known) == wanted
    assert nearest_names(name, set(known)) == wanted
    assert nearest_names(name, reversed(known)) == wanted


def test_nearest_name_is_found_among_5000_names():
    known = [f"function-number-{number}" for number in range(5000)] + ["zz-deliver"]
    assert nearest_names("zz-delivr", known) == ["zz-deliver"]


def test_hostile_names_take_no_time():
    known = ["ab" * 50_000 + str(number) for number in range(300)]
    assert nearest_names("ab" * 50_000, known) == []
    assert nearest_names("ab", known) == []


def test_hints():
    assert did_you_mean("pik", ["pick", "place"]) == "did you mean pick?"
    assert did_you_mean("rule-c", ["rule-a", "rule-b"], "see the list") == "did you mean rule-b or rule-a?"
    assert did_you_mean("zebra", ["pick"], "see the list") == "see the list"
    assert did_you_mean("/a/bc", ["/a/xy"], cutoff=0.75) == ""
    assert bracketed_suggestion("pik", ["pick"]) == " (did you mean pick?)"
    assert bracketed_suggestion("zebra", ["pick"]) == ""


def test_likeness():
    assert likeness("Goal", "gOAL") == 1
    assert likeness("goal", "xyz") == 0
