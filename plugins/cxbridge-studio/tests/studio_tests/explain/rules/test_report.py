"""Reports about a rule: the verdict, its place, the agenda, missing rules."""

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
from studio_tests.explain.worlds import world


class WorldEvidence(Evidence):
    """Evidence from an environment."""

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


def test_on_the_agenda_behind_another():
    first = "(defrule first (declare (salience 10)) (robot) =>)"
    with world(first, "(defrule it (robot) =>)", ROBOT) as env:
        told = make_verdict(explain_rule(WorldEvidence(env), "it"))
        assert told == (
            "its condition matches in one way, 1 of them is on the agenda: "
            "it comes after 1 others, first first (salience 10)"
        )
        env.run(1)
        assert "it is the next to fire" in make_verdict(explain_rule(WorldEvidence(env), "it"))


def test_fired_already():
    with world("(defrule it (robot) =>)", ROBOT) as env:
        env.run()
        told = make_verdict(explain_rule(WorldEvidence(env), "it"))
    assert told.startswith("its condition matches in one way, and it has fired for it: it fires again when")


def test_a_rule_with_a_broken_construct(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("\n(defrule it (robot (nam r)) =>)\n(defrule other =>)\n")
    with world() as env:
        env.load(file)
        story = explain_rule(WorldEvidence(env), "it")
    assert f"{file}:2: defrule it is not defined" in story.missing_reason
    assert "there is no such rule: it was refused" in make_verdict(story)
    assert to_json(story)["exists"] is False


def test_a_rule_that_is_undefined_later(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("(defrule it (robot) =>)\n")
    with world() as env:
        env.load(file)
        env.eval("(undefrule it)")
        story = explain_rule(WorldEvidence(env), "it")
    assert "defines it, but it is gone" in story.missing_reason


def test_an_unknown_rule_names_similar_ones():
    with world("(defrule drive-home (robot) =>)") as env, pytest.raises(CxbridgeError) as caught:
        explain_rule(WorldEvidence(env), "drive-hone")
    assert caught.value.hint == "did you mean drive-home?"


def test_the_page_as_a_person_reads_it(tmp_path):
    rule = "(defrule it (robot (name ?n)) ?g <- (goal (id ?n) (mode SELECTED)) (test (eq 1 1)) =>)"
    with world(rule, ROBOT, "(goal (id g) (mode SELECTED))") as env:
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


def test_a_rule_that_fired_says_so_and_lists_the_values_that_it_wants():
    rule = "(defrule it (goal (id ?id)) (robot (name ?id)) =>)"
    with world(rule, "(goal (id a))", "(goal (id b))", ROBOT) as env:
        story = replace(explain_rule(WorldEvidence(env), "it"), firings=((1.0, "f-1"), (2.0, "f-2")))
    assert make_headline(story) == (
        "rule it fired 2 times, but not again: condition 2 (robot (name ?id)) has no match: "
        "name is r in f-3, wanted a or b"
    )
    assert make_verdict(story) == (
        "fired 2 times; now its condition does not match: "
        "condition 2 has no match together with the conditions before"
    )
