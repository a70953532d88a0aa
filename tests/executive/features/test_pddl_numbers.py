"""Numbers of a domain in the core: conditions and effects."""

from __future__ import annotations

import pytest

from cxbridge.events import Level
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.manager import EnvironmentManager

DOMAIN = """(define (domain d) (:requirements :strips :typing :fluents) (:types robot place)
  (:predicates (at ?r - robot ?p - place)) (:functions (fuel ?r - robot) (far ?a ?b - place) (moved))
  (:action move :parameters (?r - robot ?a ?b - place)
    :precondition (and (at ?r ?a) (>= (fuel ?r) (* 2 (far ?a ?b))))
    :effect (and (at ?r ?b) (not (at ?r ?a))
      (decrease (fuel ?r) (far ?a ?b)) (increase (moved) (fuel ?r)))))"""
PARTS = ("domain-index", "domain-grounding", "domain-effects")
WORLD = """
(deffacts world
  (domain-object (name r1) (type robot))
  (domain-object (name a) (type place)) (domain-object (name b) (type place))
  (domain-fact (name at) (param-values r1 a))
  (problem-function (name fuel) (param-values r1) (value {fuel}))
  (problem-function (name far) (param-values a b) (value 3.0))
  (problem-function (name moved) (value 0.0))
  (goal (id G) (class C) (mode DISPATCHED) (committed-to P)) (plan (id P) (goal-id G))
  (plan-action (id 1) (plan-id P) (goal-id G) (action-name move) (param-values r1 a b)))
"""


@pytest.fixture
def start(bus, clp):
    managers = []

    def begin(fuel, world=WORLD):
        manager = EnvironmentManager(bus, [PddlParserFeature()])
        managers.append(manager)
        env = manager.create("executive")
        manager.request("executive", "pddl-parser")
        for file in ("saliences", "plan", "goal", "domain", *PARTS):
            assert env.batch(CORE_DIR / "cx" / f"{file}.clp")
        env.load(clp(world.format(fuel=fuel)))
        env.eval("(reset)")
        env.call("parse-pddl-domain", str(clp(DOMAIN, "domain.pddl")))
        env.run()
        return env

    yield begin
    for manager in managers:
        manager.close()


def action(env):
    return next(slots for _, _, slots in env.facts("plan-action"))


def number(env, name):
    return [slots["value"] for _, _, slots in env.facts("problem-function") if slots["name"] == name]


def test_condition_follows_numbers(start):
    env = start(1.0)
    for value, executable in ((9.0, "TRUE"), (2.0, "FALSE"), (6.0, "TRUE")):
        env.eval(f"(do-for-fact ((?f problem-function)) (eq ?f:name fuel) (modify ?f (value {value})))")
        env.run()
        assert action(env)["executable"] == executable


def test_effects_use_values_before_action(start):
    env = start(8.0)
    env.eval("(do-for-fact ((?a plan-action)) TRUE (modify ?a (state EXECUTION-SUCCEEDED)))")
    env.run()
    assert action(env)["state"] == "FINAL"
    assert (number(env, "fuel"), number(env, "moved")) == ([5.0], [8.0])
    assert [slots["param-values"] for _, _, slots in env.facts("domain-fact")] == [("r1", "b")]


def test_number_without_value_is_an_error_and_ends_action(start, log):
    env = start(8.0, WORLD.replace("(problem-function (name moved) (value 0.0))", ""))
    env.eval("(do-for-fact ((?a plan-action)) TRUE (modify ?a (state EXECUTION-SUCCEEDED)))")
    env.run()
    assert action(env)["state"] == "FINAL"
    assert any(
        "action move on numbers cannot be applied: (moved) has no value" in text
        for text in log.texts(Level.ERROR)
    )


def test_domain_without_numbers_fires_no_rules_of_numbers(bus, clp):
    manager = EnvironmentManager(bus, [PddlParserFeature()])
    env = manager.create("executive")
    manager.request("executive", "pddl-parser")
    env.batch(CORE_DIR / "cx" / "domain.clp")
    env.call("parse-pddl-domain", str(clp("(define (domain d) (:predicates (p)))", "domain.pddl")))
    assert not env.has_template("domain-numbers")
    manager.close()
