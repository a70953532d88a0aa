"""Reports about rules: verdicts, places, the agenda, and missing rules."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.evidence import Evidence, History
from cxbridge_studio.explain.rules.environment import read_rulebook, take_snapshot
from cxbridge_studio.explain.rules.report import (
    explain_rule,
    format_report,
    make_headline,
    make_verdict,
    to_json,
)
from studio_tests.explain.worlds import make_world


class WorldEvidence(Evidence):
    """The evidence of an environment."""

    def __init__(self, env):
        super().__init__("a world", 0, 0, History("world"))
        self.env = env

    def read_rulebook(self):
        return read_rulebook(self.env)

    def take_snapshot(self, rule):
        return take_snapshot(self.env, rule)

    def read_fact_slots(self, template):
        return []


ROBOT = "(robot (name r) (battery 7))"


def test_verdict_names_first_rule_of_agenda():
    first = "(defrule first (declare (salience 10)) (robot) =>)"
    with make_world(first, "(defrule it (robot) =>)", ROBOT) as env:
        verdict = make_verdict(explain_rule(WorldEvidence(env), "it"))
        assert verdict == (
            "its condition matches in one way, 1 of them is on the agenda: "
            "it comes after 1 others, first first (salience 10)"
        )
        env.run(1)
        assert "it is the next to fire" in make_verdict(explain_rule(WorldEvidence(env), "it"))


def test_verdict_of_fired_rule():
    with make_world("(defrule it (robot) =>)", ROBOT) as env:
        env.run()
        verdict = make_verdict(explain_rule(WorldEvidence(env), "it"))
    assert verdict.startswith(
        "its condition matches in one way, and it has fired for it: it fires again when"
    )


def test_refused_rule_has_reason(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("\n(defrule it (robot (nam r)) =>)\n(defrule other =>)\n")
    with make_world() as env:
        env.load(file)
        story = explain_rule(WorldEvidence(env), "it")
    assert f"{file}:2: defrule it is not defined" in story.missing_reason
    assert "there is no such rule: it was refused" in make_verdict(story)
    assert to_json(story)["exists"] is False


def test_undefined_rule_has_reason(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("(defrule it (robot) =>)\n")
    with make_world() as env:
        env.load(file)
        env.eval("(undefrule it)")
        story = explain_rule(WorldEvidence(env), "it")
    assert "defines it, but it is gone" in story.missing_reason


def test_unknown_rule_is_an_error_with_similar_names():
    with make_world("(defrule drive-home (robot) =>)") as env, pytest.raises(CxbridgeError) as caught:
        explain_rule(WorldEvidence(env), "drive-hone")
    assert caught.value.hint == "did you mean drive-home?"


def test_report_of_rule_has_counts_and_nearest_facts(tmp_path):
    rule = "(defrule it (robot (name ?n)) ?g <- (goal (id ?n) (mode SELECTED)) (test (eq 1 1)) =>)"
    with make_world(rule, ROBOT, "(goal (id g) (mode SELECTED))") as env:
        story = explain_rule(WorldEvidence(env), "it")
    goal = "?g <- (goal (id ?n) (mode SELECTED))"
    assert list(format_report(story)) == [
        f"rule it has not fired: condition 2 {goal} has no match: id is g in f-2, wanted r",
        "",
        "rule it",
        "in a world",
        "",
        "Its condition does not match: condition 2 has no match together with the conditions before.",
        "",
        "  condition  alone  with those before",
        "          1      1                  1  (robot (name ?n))",
        ">         2                         0  ?g <- (goal (id ?n) (mode SELECTED))",
        "          3                            (test (eq 1 1))",
        "",
        "condition 2: no fact matches together with the conditions before; the nearest agree in 1 of 2 slots",
        "  f-2 (goal (id g) (mode SELECTED) ...)",
        "    id is g, wanted r",
    ]


def test_headline_of_fired_rule_has_count_and_wanted_values():
    rule = "(defrule it (goal (id ?id)) (robot (name ?id)) =>)"
    with make_world(rule, "(goal (id a))", "(goal (id b))", ROBOT) as env:
        story = replace(explain_rule(WorldEvidence(env), "it"), firings=((1.0, "f-1"), (2.0, "f-2")))
    assert make_headline(story) == (
        "rule it fired 2 times, but not again: condition 2 (robot (name ?id)) has no match: "
        "name is r in f-3, wanted a or b"
    )
    assert make_verdict(story) == (
        "fired 2 times; now its condition does not match: "
        "condition 2 has no match together with the conditions before"
    )
