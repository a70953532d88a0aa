"""The knowledge about a problem, in memory and as facts, and the truth of formulas."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import PddlError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.pddl import parse_domain, parse_formula
from cxbridge_ros2.experts.facts import FactKnowledge
from cxbridge_ros2.experts.knowledge import Knowledge, MemoryKnowledge, ProblemExpert, find_subtypes

DOMAIN = parse_domain(
    """(define (domain d) (:requirements :adl :typing :fluents)
    (:types room hall - place place cup - object) (:constants home - place)
    (:predicates (at ?c - cup ?p - place) (never)) (:functions (far ?a ?b - place)))"""
)


@pytest.fixture
def env() -> Iterator[ClipsEnvironment]:
    environment = ClipsEnvironment("executive", EventBus(VirtualClock()))
    yield environment
    environment.destroy()


@pytest.fixture(params=["memory", "facts"])
def knowledge(request: pytest.FixtureRequest) -> Knowledge:
    if request.param == "memory":
        return MemoryKnowledge()
    env = request.getfixturevalue("env")
    for file in ("cx/saliences", "cx/plan", "cx/goal", "cx/domain", "features/problem", "features/functions"):
        assert env.batch(CORE_DIR / f"{file}.clp")
    return FactKnowledge(env, count(1))


@pytest.fixture
def expert(knowledge: Knowledge) -> ProblemExpert:
    expert = ProblemExpert(knowledge, lambda: DOMAIN)
    for name, kind in (("c1", "cup"), ("kitchen", "room"), ("7", "cup")):
        expert.add_instance(name, kind)
    expert.add_predicate(("at", ("c1", "kitchen")))
    expert.add_function(("far", ("home", "kitchen")), 2.5)
    return expert


def test_knowledge_has_added_and_updated_entries(expert: ProblemExpert, knowledge: Knowledge):
    expert.add_instance("c1", "cup")
    expert.add_predicate(("at", ("c1", "kitchen")))
    assert dict(knowledge.instances) == {"c1": "cup", "kitchen": "room", "7": "cup"}
    assert list(knowledge.predicates) == [("at", ("c1", "kitchen"))]
    assert dict(knowledge.functions) == {("far", ("home", "kitchen")): 2.5}
    expert.update_function(("far", ("home", "kitchen")), 4)
    assert dict(knowledge.functions) == {("far", ("home", "kitchen")): 4.0}
    expert.set_goal(parse_formula("(at 7 home)"))
    expert.set_goal(parse_formula("(and (at 7 home) (not (never)))"))
    assert knowledge.goal == "(and (at 7 home) (not (never)))"
    texts = str(expert.make_problem().init), str(expert.make_problem().numbers)
    assert "kitchen" in texts[0]
    assert "4.0" in texts[1]


def test_removed_entries_are_gone(expert: ProblemExpert, knowledge: Knowledge):
    expert.remove_predicate(("at", ("c1", "kitchen")))
    expert.remove_predicate(("at", ("c1", "kitchen")))
    assert list(knowledge.predicates) == []
    expert.remove_function(("far", ("home", "kitchen")))
    expert.remove_function(("far", ("home", "kitchen")))
    assert dict(knowledge.functions) == {}
    expert.clear()
    assert (dict(knowledge.instances), knowledge.goal) == ({}, "")


@pytest.mark.parametrize(
    ("goal", "remaining"),
    [
        ("(and (at c1 home) (at 7 home))", "(and (at 7 home))"),
        ("(at c1 home)", ""),
        ("(or (at c1 home) (at 7 home))", ""),
        ("(at 7 home)", "(at 7 home)"),
    ],
)
def test_removed_instance_leaves_goal_and_predicates(
    expert: ProblemExpert, knowledge: Knowledge, goal: str, remaining: str
):
    expert.set_goal(parse_formula(goal))
    expert.remove_instance("c1")
    assert knowledge.goal == remaining
    assert list(knowledge.predicates) == []
    with pytest.raises(PddlError, match="'c1' is not an instance"):
        expert.remove_instance("c1")


@pytest.mark.parametrize(
    ("formula", "is_true"),
    [
        ("(and)", True),
        ("(exists (?c - cup) (at ?c kitchen))", True),
        ("(exists (?c - cup ?p - hall) (at ?c ?p))", False),
        ("(forall (?c - cup) (at ?c kitchen))", False),
        ("(imply (at 7 kitchen) (never))", True),
        ("(imply (at c1 kitchen) (never))", False),
        ("(exists (?p - place) (and (at c1 ?p) (= ?p kitchen)))", True),
        ("(= (far home kitchen) 2.5)", True),
        ("(< (far home kitchen) 2.5)", False),
        ("(>= (* (far home kitchen) 2) 5)", True),
        ("(> (- (far home kitchen)) 0)", False),
        ("(= (/ 1 0) 0)", False),
        ("(= (far kitchen home) 0)", False),
        ("(= 7 07)", False),  # objects
        ("(= 1e1 10)", False),
        ("(= inf infinity)", False),
        ("(= nan nan)", True),
        ("(= (far home kitchen) 25e-1)", True),
        ("(exists (?c - cup) (= ?c 7))", True),
        ("(exists (?c - cup) (< ?c 8))", False),  # objects have no order
        ("(exists (?c - cup) (= (+ (far home kitchen) 4.5) ?c))", False),
    ],
)
def test_truth_of_formulas(expert: ProblemExpert, formula: str, is_true: bool):
    for name in ("07", "1e1", "10", "inf", "infinity", "nan"):
        expert.add_instance(name, "cup")
    assert expert.is_satisfied(parse_formula(formula)) is is_true


def test_goal_with_unknown_type_is_refused(expert: ProblemExpert):
    with pytest.raises(PddlError, match="Unknown type: c - cop"):
        expert.is_satisfied(parse_formula("(forall (?c - cop) (never))"))


def test_subtypes_of_types():
    assert find_subtypes(DOMAIN, "place") == ["room", "hall"]
    assert find_subtypes(DOMAIN, "object") == ["room", "hall", "place", "cup"]
    assert find_subtypes(DOMAIN, "cup") == []


def test_expert_without_domain_accepts_any_entry():
    expert = ProblemExpert(MemoryKnowledge(), lambda: None)
    expert.add_instance("x", "anything")
    expert.add_predicate(("any", ("y",)))
    with pytest.raises(PddlError, match="there is no domain"):
        expert.make_problem()


def test_agent_without_core_is_reported(env):
    expert = ProblemExpert(FactKnowledge(env, count(1)), lambda: DOMAIN)
    with pytest.raises(PddlError, match="no template domain-object"):
        expert.add_instance("c1", "cup")
