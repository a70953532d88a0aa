"""The features `plansys2` and `skill_execution` of the original, without its files."""

from __future__ import annotations

from typing import cast

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus, Level
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.host.values import TRUE, Symbol
from cxbridge.executive.manager import EnvironmentManager
from cxbridge_planning.settings import PlannerSettings
from cxbridge_ros2cx.plansys2 import PlanSys2Feature
from cxbridge_ros2cx.skill_board_client import SkillBoardClient
from cxbridge_ros2cx.skill_execution import SkillExecutionFeature
from tests.executive.conftest import Log
from tests.executive.features.test_skill_board import FakeExecutor, FakeSkills

DOMAIN = """(define (domain drive) (:requirements :strips :typing) (:types robot place)
  (:predicates (at ?r - robot ?p - place))
  (:action move :parameters (?r - robot ?a ?b - place) :precondition (at ?r ?a)
    :effect (and (at ?r ?b) (not (at ?r ?a)))))"""

TEMPLATES = """
  (deftemplate plan (slot id) (slot goal-id) (slot type))
  (deftemplate plan-action
    (slot id) (slot goal-id) (slot plan-id) (slot action-name) (multislot param-values))
  (deftemplate pddl-plan-feedback (slot status) (slot plan-id))
  (deftemplate skill-feedback (slot skill-id) (slot agent-id) (slot status) (slot error))
  (deftemplate skill-action-execinfo (slot goal-id) (slot plan-id) (slot action-id) (slot skill-id))
  (deftemplate domain-pending-sensed-fact
    (slot name) (slot goal-id) (slot plan-id) (slot action-id) (slot type) (multislot param-values))
  (deftemplate domain-fact (slot name) (multislot param-values))
"""


class Skills(FakeSkills):
    """A fake skill board with dummies."""

    def request(self, skill, parameters, agent, on_change, name=""):
        self.names = [*getattr(self, "names", []), name]
        return super().request(skill, parameters, agent, on_change)

    def apply_timeout(self, action):
        pass

    def lacks_sensors(self, executor):
        return executor == "dummy"


class Bench:
    def __init__(self, tmp_path, domain=DOMAIN):
        self.bus = EventBus(VirtualClock())
        self.log = Log(self.bus)
        self.skills = Skills()
        self.removed = 0
        parser = PddlParserFeature()
        features = [
            parser,
            PlanSys2Feature(PlannerSettings(planner="pyperplan"), parser.domain_of),
            SkillExecutionFeature(lambda: cast("SkillBoardClient", self.skills), self._remove),
        ]
        self.manager = EnvironmentManager(self.bus, features)
        self.env = self.manager.create("executive")
        for feature in features:
            assert self.manager.request("executive", feature.name) == TRUE
        (tmp_path / "templates.clp").write_text(TEMPLATES)
        assert self.env.load(tmp_path / "templates.clp")
        (tmp_path / "domain.pddl").write_text(domain)
        self.env.call("parse-pddl-domain", str(tmp_path / "domain.pddl"))
        self.log.lines.clear()  # drops errors about missing templates of the domain

    def _remove(self):
        self.removed += 1

    def facts(self, template, *slots):
        return [tuple(fact[slot] for slot in slots) for _, _, fact in self.env.facts(template)]

    def feedback(self):
        """Read the skills, and remove and return the feedback."""
        self.env.call("call-skill-read")
        facts = self.facts("skill-feedback", "skill-id", "agent-id", "status", "error")
        self.env.eval("(do-for-all-facts ((?f skill-feedback)) TRUE (retract ?f))")
        return facts

    def errors(self):
        return self.log.texts(Level.ERROR)


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.manager.close()


def add_world(env):
    for name, kind in (("r2", "robot"), ("home", "place"), ("work", "place")):
        env.call("psys2-add-domain-instance", Symbol(name), Symbol(kind))
    env.call("psys2-add-domain-predicate", "(at r2 home)")


def test_facts_of_plan_precede_actions_and_feedback(bench):
    add_world(bench.env)
    bench.env.call("psys2-call-planner", Symbol("G"), "(and (at r2 work))", Symbol("P"))
    assert bench.facts("plan", "id", "goal-id", "type") == [("P", "G", "SEQUENTIAL")]
    slots = ("id", "goal-id", "plan-id", "action-name", "param-values")
    assert bench.facts("plan-action", *slots) == [(1, "G", "P", "move", ("r2", "home", "work"))]
    assert bench.facts("pddl-plan-feedback", "status", "plan-id") == [("PLANNED", "P")]
    order = [template for _, template, _ in bench.env.facts()]
    assert order[-3:] == ["plan", "plan-action", "pddl-plan-feedback"]


@pytest.mark.parametrize(
    "goal", ["(and (at r2 nowhere))", "(and (flies r2))", "(and (at r2", "(not (at r2 home)"]
)
def test_refused_goal_gives_failed_plan(bench, goal):
    add_world(bench.env)
    bench.env.call("psys2-call-planner", Symbol("G"), goal, Symbol("P"))
    assert bench.facts("pddl-plan-feedback", "status", "plan-id") == [("PLAN-FAILED", "P")]
    assert len(bench.errors()) == 1
    assert bench.facts("plan", "id") == []


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        ("psys2-add-domain-instance", ("x", "boat"), "has no type"),
        ("psys2-add-domain-predicate", ("(flies r2)",), "Unknown predicate: flies"),
        ("psys2-add-domain-predicate", ("(at r3 home)",), "there is no instance r3"),
        ("psys2-add-domain-predicate", ("()",), "Unknown predicate: "),
    ],
)
def test_problem_expert_refuses_invalid_facts(bench, function, arguments, message):
    add_world(bench.env)
    bench.env.call(function, *arguments)
    assert [message in error for error in bench.errors()] == [True]


def call_skill(env, skill_id="move_gen1", agent=""):
    env.call("call-skill-execution", Symbol(skill_id), Symbol("move"), "r2 home work", "", agent)


@pytest.mark.parametrize(("state", "error"), [("FAILED", "door closed"), ("CANCELLED", "CANCELLED")])
def test_failed_skill_has_reason(bench, state, error):
    call_skill(bench.env)
    bench.skills.set_action(1, state=state, error="door closed")
    assert bench.feedback() == [("move_gen1", "", "S_FAILED", error)]


def test_impossible_skill_fails(bench):
    bench.env.call("call-skill-execution", Symbol("s1"), Symbol("impossible"), "", "", "")
    assert bench.feedback() == [("s1", "", "S_FAILED", "nobody can do that")]


def test_second_skill_of_agent_cancels_first(bench):
    call_skill(bench.env, "a")
    call_skill(bench.env, "b")
    assert bench.skills.stopped == [1]
    assert [row[0] for row in bench.feedback()] == ["b"]


def test_cancel_stops_skill_of_agent(bench):
    call_skill(bench.env, agent="robot1")
    bench.env.call("call-skill-cancel", "robot1")
    assert bench.skills.stopped == [1]
    bench.env.call("call-skill-cancel", "robot2")
    assert ["robot2" in error for error in bench.errors()] == [True]


@pytest.mark.parametrize(("executor", "senses"), [("dummy", True), ("real", False)])
@pytest.mark.parametrize("kind", ["POSITIVE", "NEGATIVE"])
def test_effects_of_dummy_are_sensed(bench, executor, senses, kind):
    bench.skills.show(FakeExecutor(executor, "default", ("move",)))
    call_skill(bench.env)
    bench.env.assert_string(
        "(skill-action-execinfo (goal-id G) (plan-id P) (action-id 7) (skill-id move_gen1))"
    )
    if kind == "NEGATIVE":
        bench.env.assert_string("(domain-fact (name at) (param-values r2 work))")
    bench.skills.set_action(1, state="SUCCEEDED", executor=executor)
    bench.feedback()
    for action in (7, 8):
        bench.env.assert_string(
            f"(domain-pending-sensed-fact (name {'at' if action == 7 else 'other'}) (goal-id G) (plan-id P)"
            f" (action-id {action}) (type {kind}) (param-values r2 work))"
        )
    bench.feedback()
    facts = [("at", ("r2", "work"))]
    expected = facts if (kind == "POSITIVE") == senses else []
    assert bench.facts("domain-fact", "name", "param-values") == expected
