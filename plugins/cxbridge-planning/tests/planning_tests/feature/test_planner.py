"""The feature `planner`."""

from __future__ import annotations

import os

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import Level, PlannerCall
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import FALSE, TRUE
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.executive.pddl.printer import format_term
from cxbridge_planning.feature.planner import PlannerFeature
from cxbridge_planning.needs import Need
from cxbridge_planning.registry import make_planner, planner_names
from cxbridge_planning.service.service import PlanningService
from cxbridge_planning.settings import PlannerSettings

DOMAIN = """(define (domain d) (:requirements :strips :typing) (:types cup place) (:constants home - place)
  (:predicates (at ?c - cup ?p - place) (never))
  (:action carry :parameters (?c - cup ?a ?b - place) :precondition (at ?c ?a)
    :effect (and (at ?c ?b) (not (at ?c ?a)))))"""

AGENT = """
(deffacts world
  (domain-object (name c1) (type cup)) (domain-object (name shelf) (type place))
  (domain-fact (name at) (param-values c1 home)) (domain-fact (name something-else) (param-values 1 2)))
"""

GOAL = "(at c1 shelf)"
FEATURES = ("pddl-parser", "planner")
CORE = ("saliences", "plan", "goal", "domain", "pddl")


class Agent:
    """An environment with the features, the facts of an agent and a domain."""

    def __init__(
        self, bus, clp, settings, *, domain=DOMAIN, agent=AGENT, features=("pddl-parser", "planner")
    ):
        parser = PddlParserFeature()
        self.manager = EnvironmentManager(bus, [parser, PlannerFeature(settings, parser.domain_of)])
        self.env = self.manager.create("executive")
        for feature in features:
            assert self.manager.request("executive", feature) == TRUE
        for file in CORE:
            assert self.env.batch(CORE_DIR / "cx" / f"{file}.clp")
        self.env.load(clp(agent))
        self.env.eval("(reset)")
        if "pddl-parser" in features:
            self.env.call("parse-pddl-domain", str(clp(domain, "domain.pddl")))

    def loop(self):
        self.manager.before_run("executive")
        self.env.run()


@pytest.fixture
def make_agent(bus, clp):
    agents = []

    def make(settings, **options):
        agents.append(Agent(bus, clp, settings, **options))
        return agents[-1]

    yield make
    for agent in agents:
        agent.manager.close()


@pytest.fixture
def agent(make_agent):
    return make_agent(PlannerSettings(planner="pyperplan", timeout=60.0))


@pytest.fixture
def manager(agent):
    return agent.manager


@pytest.fixture
def env(agent, log):
    return agent.env


@pytest.fixture
def loop(agent):
    return agent.loop


def read_facts(env, template):
    return [slots for _, _, slots in env.facts(template)]


def add_goal(env, mode="SELECTED"):
    env.assert_string(f"(goal (id G) (class C) (mode {mode}))")


def test_goal_is_expanded_with_plan(env, loop):
    add_goal(env)
    assert env.call("planner-plan", "G", "(at c1 shelf)") == "plan-1"
    (call,) = read_facts(env, "planner-call")
    assert (call["goal-id"], call["status"], call["planner"]) == ("G", "RUNNING", "pyperplan")
    loop()
    (plan,) = read_facts(env, "plan")
    assert (plan["id"], plan["goal-id"], plan["type"]) == ("plan-1", "G", "SEQUENTIAL")
    (action,) = read_facts(env, "plan-action")
    assert (action["id"], action["plan-id"], action["goal-id"]) == (1, "plan-1", "G")
    assert (action["action-name"], action["param-values"]) == ("carry", ("c1", "home", "shelf"))
    assert [each["mode"] for each in read_facts(env, "goal")] == ["EXPANDED"]
    assert read_facts(env, "planner-call") == []


def test_partial_plan_ignores_objects_outside_part(env, loop):
    """The problem leaves out an object with an undefined type, which would make the problem invalid."""
    env.assert_string("(domain-object (name x) (type unheard-of))")
    env.assert_string("(domain-fact (name at) (param-values x home))")
    add_goal(env)
    assert env.eval('(planner-plan-part G "(at c1 shelf)" (create$ c1 shelf))') == "plan-1"
    loop()
    (action,) = read_facts(env, "plan-action")
    assert action["param-values"] == ("c1", "home", "shelf")
    assert read_checks(env) == [("plan-1", "TRUE", "")]
    env.assert_string("(domain-fact (name at) (param-values x shelf))")
    loop()
    assert read_checks(env) == [("plan-1", "TRUE", "")]


def test_problem_has_values_of_functions(env, loop, clp, monkeypatch):
    requests = []
    call = PlanningService.call

    def record_request(service, request):
        requests.append(request)
        return call(service, request)

    monkeypatch.setattr(PlanningService, "call", record_request)
    env.load(CORE_DIR / "features" / "functions.clp")
    text = DOMAIN.replace("(:action", "(:functions (weight ?c - cup)) (:action")
    env.call("domain-wipe")
    env.call("parse-pddl-domain", str(clp(text, "domain.pddl")))
    env.assert_string("(domain-object (name c1) (type cup))")
    env.assert_string("(domain-fact (name at) (param-values c1 home))")
    env.assert_string("(problem-function (name weight) (param-values c1) (value 2.5))")
    env.assert_string("(problem-function (name unknown) (value 1.0))")
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 home)")
    loop()
    assert [each["mode"] for each in read_facts(env, "goal")] == ["EXPANDED"]
    ((term, value),) = requests[0].problem.numbers
    assert (format_term(term), value) == ("(weight c1)", 2.5)


def test_goal_without_plan_fails(env, loop, log):
    add_goal(env)
    env.call("planner-plan", "G", "(never)")
    loop()
    (failed,) = read_facts(env, "goal")
    assert (failed["mode"], failed["outcome"], failed["error"]) == (
        "FINISHED",
        "FAILED",
        ("PLANNING", "NO-PLAN"),
    )
    assert "there is no plan" in failed["message"]
    assert any("No plan for goal 'G'" in text for text in log.texts(Level.ERROR))


def read_checks(env):
    return [(each["plan-id"], each["valid"], each["message"]) for each in read_facts(env, "plan-valid")]


def test_plan_is_refused_if_world_has_changed(env, loop, log):
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 shelf)")
    env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name at) (retract ?f))")
    loop()
    (failed,) = read_facts(env, "goal")
    assert (failed["outcome"], failed["error"]) == ("FAILED", ("PLANNING", "INVALID"))
    assert failed["message"] == (
        "the plan does not hold: step 1, (carry c1 home shelf): (at c1 home) is false"
    )
    assert read_facts(env, "plan") == read_facts(env, "plan-valid") == []


def test_plan_is_checked_after_each_change_of_world(env, loop, log):
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 shelf)")
    loop()
    assert read_checks(env) == [("plan-1", "TRUE", "")]
    env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name at) (retract ?f))")
    loop()
    reason = "step 1, (carry c1 home shelf): (at c1 home) is false"
    assert read_checks(env) == [("plan-1", "FALSE", reason)]
    assert any(f"plan 'plan-1' is no longer valid: {reason}" in text for text in log.texts(Level.WARN))
    env.assert_string("(domain-fact (name at) (param-values c1 home))")
    loop()
    assert read_checks(env) == [("plan-1", "TRUE", "")]


def test_check_assumes_success_of_running_action(env, loop):
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 shelf)")
    loop()
    env.eval("(do-for-fact ((?a plan-action)) TRUE (modify ?a (state RUNNING)))")
    env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name at) (retract ?f))")
    loop()
    assert read_checks(env) == [("plan-1", "TRUE", "")]


def test_rules_can_check_plan(env, loop):
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 shelf)")
    loop()
    assert env.call("planner-check", "plan-1") == TRUE
    env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name at) (retract ?f))")
    assert env.call("planner-check", "plan-1") == FALSE
    assert env.call("planner-check", "plan-7") == FALSE


def test_check_result_is_retracted_with_plan(env, loop):
    add_goal(env)
    env.call("planner-plan", "G", "(at c1 shelf)")
    loop()
    env.eval("(do-for-all-facts ((?p plan)) TRUE (retract ?p))")
    loop()
    assert read_checks(env) == []


def test_disabled_checks_accept_invalid_plan(make_agent):
    agent = make_agent(PlannerSettings(planner="pyperplan", check_plans=False))
    add_goal(agent.env)
    agent.env.call("planner-plan", "G", "(at c1 shelf)")
    agent.env.eval("(do-for-fact ((?f domain-fact)) (eq ?f:name at) (retract ?f))")
    agent.loop()
    assert [each["mode"] for each in read_facts(agent.env, "goal")] == ["EXPANDED"]
    assert read_checks(agent.env) == []


BAD_PROGRAMS = {
    "crashes": ("kill -SEGV $$", "FAILED", "without a plan"),
    "prints rubbish": ("echo rubbish; exit 3", "FAILED", "without a plan: rubbish"),
    "prints no plan": ("exit 0", "FAILED", "without a plan"),
    "plans unknown action": ("printf 'ff: found legal plan\\nstep 0: FLY C1 HOME SHELF\\n'", "FAILED", "FLY"),
    "finds goal unreachable": ("echo 'ff: goal can be simplified to FALSE'", "NO-PLAN", "there is no plan"),
    "never ends": ("exec sleep 1000", "TIMEOUT", ""),
}


def add_ff(script, monkeypatch, folder):
    """Put a program `ff` on the PATH."""
    (folder / "ff").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "ff").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")


@pytest.fixture
def bad_program(request, monkeypatch, tmp_path):
    """Put a program `ff` on the PATH before planners start; return the expected status and message."""
    script, status, message = BAD_PROGRAMS[request.param]
    add_ff(script, monkeypatch, tmp_path)
    return status, message


@pytest.mark.parametrize("bad_program", BAD_PROGRAMS, indirect=True)
def test_failed_planner_fails_goal(bad_program, env, loop):
    status, message = bad_program
    add_goal(env)
    env.call("planner-plan-with", "G", "(at c1 shelf)", "ff", 0.5 if status == "TIMEOUT" else 60)
    loop()
    (failed,) = read_facts(env, "goal")
    assert (failed["mode"], failed["outcome"]) == ("FINISHED", "FAILED")
    assert failed["error"] == ("PLANNING", status)
    assert message in failed["message"]
    assert read_facts(env, "planner-call") == []
    assert read_facts(env, "plan") == []


def test_call_without_goal_remains_as_fact(env, loop):
    env.call("planner-plan", "nil", "(at c1 shelf)")
    loop()
    (call,) = read_facts(env, "planner-call")
    assert (call["status"], call["plan-id"], call["message"]) == ("PLANNED", "plan-1", "")
    assert len(read_facts(env, "plan-action")) == 1


def test_call_is_cancelled_without_selected_goal(env, loop):
    env.call("planner-plan", "G", "(at c1 shelf)")  # the goal G does not exist
    loop()
    assert read_facts(env, "planner-call") == []


@pytest.fixture
def endless(monkeypatch, tmp_path):
    """Put an endless program `ff` on the PATH before planners start."""
    add_ff(BAD_PROGRAMS["never ends"][0], monkeypatch, tmp_path)


def test_running_call_is_cancelled_once(endless, env, loop):
    assert env.call("planner-cancel", "plan-9") == FALSE
    env.call("planner-plan-with", "nil", "(at c1 shelf)", "ff", 60)
    assert env.call("planner-cancel", "plan-1") == TRUE
    loop()
    (call,) = read_facts(env, "planner-call")
    assert call["status"] == "CANCELLED"
    assert env.call("planner-cancel", "plan-1") == FALSE


def test_bus_gets_planner_calls(endless, manager, bus, env, loop):
    events: list[PlannerCall] = []
    bus.subscribe(events.append, PlannerCall)
    env.call("planner-plan", "G", "(at c1 shelf)")
    loop()
    env.call("planner-plan", "nil", "(never)")
    loop()
    env.call("planner-plan", "nil", "(at c1")
    env.call("planner-plan-with", "nil", "(at c1 shelf)", "ff", 60)
    manager.close()
    assert [(event.call, event.goal, event.problem, event.status, event.actions) for event in events] == [
        ("plan-1", "G", "(at c1 shelf)", "started", 0),
        ("plan-1", "G", "(at c1 shelf)", "found", 1),
        ("plan-2", "nil", "(never)", "started", 0),
        ("plan-2", "nil", "(never)", "none", 0),
        ("", "nil", "(at c1", "failed", 0),
        ("plan-3", "nil", "(at c1 shelf)", "started", 0),
        ("plan-3", "nil", "(at c1 shelf)", "cancelled", 0),
    ]
    assert {(event.env, event.domain) for event in events} == {("executive", "d")}
    assert [event.planner for event in events] == ["pyperplan"] * 5 + ["ff"] * 2
    assert [event.duration_us > 0 for event in events] == [
        event.status in {"found", "none", "cancelled"} for event in events
    ]
    assert [bool(event.reason) for event in events] == [False, False, False, True, True, False, True]


def test_numeric_names_remain_numbers(env, loop):
    env.assert_string("(domain-object (name 7) (type cup))")
    env.assert_string("(domain-fact (name at) (param-values 7 home))")
    env.call("planner-plan", "nil", "(at 7 shelf)")
    loop()
    assert read_facts(env, "plan-action")[0]["param-values"] == (7, "home", "shelf")


@pytest.mark.parametrize(
    ("fact", "formula", "message"),
    [
        ("", "(at c1", "never closed"),
        ("", "(on c1 shelf)", "Unknown predicate: on"),
        ("", "(at c9 shelf)", "c9"),
        ("(domain-object (name x) (type unheard-of))", GOAL, "Unknown type: x - unheard-of"),
        ("(domain-fact (name at) (param-values c9 home))", GOAL, "c9"),
        ("(domain-fact (name at) (param-values c1))", GOAL, "expected 2 but got 1"),
        ("(domain-fact (name at) (param-values shelf home))", GOAL, "expects cup but got place"),
    ],
)
def test_invalid_goal_or_world_fails_call(env, log, fact, formula, message):
    if fact:
        env.assert_string(fact)
    assert env.call("planner-plan", "G", formula) == "no-plan-1"
    assert any(message in text for text in log.texts(Level.ERROR))
    (call,) = read_facts(env, "planner-call")
    assert (call["goal-id"], call["status"]) == ("G", "FAILED")
    assert message in call["message"]


def test_invalid_call_fails_goal(env, loop):
    add_goal(env)
    env.call("planner-plan", "G", "(on c1 shelf)")
    loop()
    (failed,) = read_facts(env, "goal")
    assert (failed["outcome"], failed["error"]) == ("FAILED", ("PLANNING", "FAILED"))
    assert "Unknown predicate: on" in failed["message"]
    assert read_facts(env, "planner-call") == []


@pytest.mark.parametrize(
    "options", [{"domain": DOMAIN[:-1]}, {"features": ["planner"]}], ids=["broken domain", "no domain"]
)
def test_missing_domain_is_reported(make_agent, log, options):
    agent = make_agent(PlannerSettings(), **options)
    assert agent.env.call("planner-plan", "G", GOAL) == "no-plan-1"
    assert "parse-pddl-domain first" in log.texts(Level.ERROR)[-1]
    assert any("domain.pddl" in text for text in log.texts(Level.ERROR)) == ("domain" in options)


def test_settings_are_parsed():
    text = "planner: {planner: ff, timeout: 2.5, at-once: 3, memory: 0, options: {search: ehs, program: x}}"
    assert PlannerSettings.from_config(Configuration.from_text(text, "x.yaml")) == PlannerSettings(
        "ff", 2.5, 3, 0, {"search": "ehs", "program": "x"}
    )
    assert PlannerSettings.from_config(Configuration.from_text("a: 1", "x.yaml")) == PlannerSettings()
    with pytest.raises(ConfigError, match=r"/planner/at-once"):
        PlannerSettings.from_config(Configuration.from_text("planner: {at-once: many}", "x.yaml"))


NUMERIC = """(define (domain d) (:requirements :strips :typing :fluents) (:types robot place)
  (:predicates (at ?r - robot ?p - place)) (:functions (fuel ?r - robot) (far ?a ?b - place))
  (:action move :parameters (?r - robot ?a ?b - place)
    :precondition (and (at ?r ?a) (> (far ?a ?b) 0) (>= (fuel ?r) (far ?a ?b)))
    :effect (and (at ?r ?b) (not (at ?r ?a)) (decrease (fuel ?r) (far ?a ?b)))))"""
TEMPORAL = """(define (domain d) (:requirements :strips :typing :durative-actions) (:types robot place)
  (:predicates (at ?r - robot ?p - place)) (:functions (far ?a ?b - place))
  (:durative-action move :parameters (?r - robot ?a ?b - place) :duration (= ?duration (far ?a ?b))
    :condition (at start (at ?r ?a)) :effect (and (at start (not (at ?r ?a))) (at end (at ?r ?b)))))"""
DRIVE = """
(deffacts world
  (domain-object (name r1) (type robot))
  (domain-object (name a) (type place)) (domain-object (name b) (type place))
  (domain-fact (name at) (param-values r1 a))
  (problem-function (name fuel) (param-values r1) (value 5.0))
  (problem-function (name far) (param-values a b) (value 3.0))
  (problem-function (name far) (param-values b a) (value 4.0))
  (problem-function (name far) (param-values a a) (value 1.0))
  (problem-function (name far) (param-values b b) (value 1.0)))
"""
KINDS = {"numeric": (NUMERIC, Need.NUMBERS), "temporal": (TEMPORAL, Need.TIME)}


PLANNERS = [
    (kind, name)
    for kind, (_, need) in KINDS.items()
    for name in planner_names()
    if need in make_planner(name).understands
]


@pytest.mark.parametrize(("kind", "planner"), PLANNERS)
def test_numeric_and_temporal_plans(kind, planner, make_agent):
    if missing := make_planner(planner).unavailable_reason:
        pytest.skip(missing)
    agent = make_agent(PlannerSettings(), domain=KINDS[kind][0], agent=DRIVE)
    add_goal(agent.env)
    agent.env.call("planner-plan-with", "G", "(at r1 b)", planner, 60)
    agent.loop()
    assert [each["message"] for each in read_facts(agent.env, "goal")] == [""]
    (plan,) = read_facts(agent.env, "plan")
    (action,) = read_facts(agent.env, "plan-action")
    assert action["param-values"] == ("r1", "a", "b")
    if kind == "temporal":
        assert plan["type"] == "TEMPORAL"
        assert action["dispatch-time"] == pytest.approx(0, abs=0.01)
        assert action["duration"] == pytest.approx(3.0)
