"""The compilation to STRIPS and the plans of pyperplan, compared with a PDDL interpreter."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import PlanningError, UnknownPlannerError
from cxbridge_planning.compile import conditions, effects
from cxbridge_planning.compile.grounding import ground
from cxbridge_planning.engines.pyperplan import HEURISTICS, SEARCHES, PyperplanPlanner
from planning_tests.interpreter import World

HEAD = """(define (domain d) (:requirements :adl :typing)
  (:types cup box - thing place)
  (:constants home - place)
  (:predicates (at ?t - thing ?p - place) (link ?a ?b - place) (full ?c - cup) (lit))
"""

FETCH = (
    HEAD
    + """
  (:action move :parameters (?t - thing ?a ?b - place)
    :precondition (and (at ?t ?a) (or (link ?a ?b) (link ?b ?a)))
    :effect (and (at ?t ?b) (not (at ?t ?a))))
  (:action fill :parameters (?c - cup) :precondition (and (at ?c home) (not (full ?c))) :effect (full ?c))
  (:action light :parameters () :precondition (not (lit)) :effect (lit))
  (:action clean :parameters () :precondition (lit)
    :effect (and (not (lit)) (forall (?c - cup) (when (full ?c) (not (full ?c)))))))
"""
)


def make_problem(goal, init="", objects="c1 c2 - cup b1 - box p q - place"):
    return f"(define (problem x) (:domain d) (:objects {objects}) (:init {init}) (:goal {goal}))"


def solve(domain_text, problem_text, planner=None):
    domain = parse_domain(domain_text)
    task = parse_problem(problem_text, domain)
    plan = (planner or PyperplanPlanner()).solve(domain, task)
    world = World(domain, task)
    if plan is None:
        assert not world.is_solvable()
    else:
        assert world.is_solution(plan)
    return None if plan is None else [str(step) for step in plan]


START = "(at c1 p) (at c2 q) (at b1 q) (link p home) (link q p) (full c2)"


@pytest.mark.parametrize(
    ("goal", "steps"),
    [
        ("(and)", []),
        ("(at c1 p)", []),
        ("(at c1 home)", ["(move c1 p home)"]),
        ("(and (full c1) (at c1 p))", ["(move c1 p home)", "(fill c1)", "(move c1 home p)"]),
        ("(not (full c2))", ["(light)", "(clean)"]),
        ("(or (lit) (full c1))", ["(light)"]),
        ("(exists (?c - cup) (at ?c home))", ["(move c1 p home)"]),
        ("(forall (?c - cup) (not (full ?c)))", ["(light)", "(clean)"]),
        ("(imply (full c2) (lit))", ["(light)"]),
        ("(and (lit) (= c1 c1))", ["(light)"]),
        ("(= c1 c2)", None),
        ("(link home q)", None),
        ("(not (link p home))", None),
    ],
)
def test_goals_have_expected_plans(goal, steps):
    plan = solve(FETCH, make_problem(goal, START))
    assert plan == steps


def test_unreachable_actions_are_not_grounded():
    domain = parse_domain(FETCH)
    task = ground(domain, parse_problem(make_problem("(at c1 home)", "(at c1 p) (link p home)"), domain))
    assert {str(each.action) for each in task.operators} == {
        "(move c1 p home)",
        "(move c1 home p)",
    }


def test_facts_of_wrong_type_ground_no_action():
    text = HEAD + "(:action go :parameters (?c - cup) :precondition (at ?c home) :effect (lit)))"
    assert solve(text, make_problem("(lit)", "(at b1 home)")) is None


def test_parameter_with_either_accepts_both_types():
    text = HEAD + "(:action go :parameters (?x - (either box place)) :precondition (and) :effect (lit)))"
    assert solve(text, make_problem("(lit)", objects="c1 - cup")) == ["(go home)"]


def test_fact_deleted_and_added_by_same_action_is_true():
    text = HEAD + "(:action go :parameters () :precondition (not (lit)) :effect (and (lit) (not (lit)))))"
    assert solve(text, make_problem("(lit)")) == ["(go)"]


def test_nested_conditional_effects():
    text = (
        HEAD
        + """(:action go :parameters () :precondition (and)
      :effect (forall (?c - cup) (when (at ?c home) (when (not (full ?c)) (and (full ?c) (lit)))))))"""
    )
    assert solve(text, make_problem("(lit)", "(at c1 home)")) == ["(go)"]
    assert solve(text, make_problem("(lit)", "(at c1 home) (full c1)")) is None


def test_condition_with_too_many_alternatives_is_refused(monkeypatch):
    monkeypatch.setattr(conditions, "MAX_ALTERNATIVES", 3)
    goal = "(and (or (lit) (full c1)) (or (at c1 home) (full c2)))"
    with pytest.raises(PlanningError, match="more than 3 alternatives"):
        solve(FETCH, make_problem(goal, START))


def test_too_many_conditional_effects_are_refused(monkeypatch):
    monkeypatch.setattr(effects, "MAX_CONDITIONS", 1)
    with pytest.raises(PlanningError, match="more than 1 different conditions"):
        solve(FETCH, make_problem("(not (full c1))", START + "(full c1) (lit)"))


def test_too_many_ground_actions_are_refused(monkeypatch):
    monkeypatch.setattr("cxbridge_planning.compile.grounding.MAX_OPERATORS", 5)
    with pytest.raises(PlanningError, match="more than 5 ground actions"):
        solve(FETCH, make_problem("(full c1)", START))


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("heuristic", HEURISTICS)
def test_each_search_with_each_heuristic_finds_plan(search, heuristic):
    goal = "(and (full c1) (at c1 p) (not (full c2)))"
    assert solve(FETCH, make_problem(goal, START), PyperplanPlanner(search, heuristic))


@pytest.mark.parametrize(("search", "heuristic"), [("dijkstra", "hff"), ("gbf", "hgg")])
def test_unknown_search_or_heuristic_is_refused(search, heuristic):
    with pytest.raises(UnknownPlannerError, match="pyperplan has no"):
        PyperplanPlanner(search, heuristic)


# ---- random domains

PREDICATES = {"p": 1, "q": 1, "r": 2, "z": 0}
OBJECTS = ("a", "b")


def atoms(names):
    return st.sampled_from(sorted(PREDICATES)).flatmap(
        lambda predicate: st.tuples(*[st.sampled_from(names)] * PREDICATES[predicate]).map(
            lambda terms: f"({' '.join((predicate, *terms))})"
        )
    )


def conditions_over(names):
    leaves = atoms(names) | st.tuples(st.sampled_from(names), st.sampled_from(names)).map(
        lambda pair: f"(= {pair[0]} {pair[1]})"
    )
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.lists(inner, max_size=3).map(lambda parts: f"(and {' '.join(parts)})"),
            st.lists(inner, min_size=1, max_size=2).map(lambda parts: f"(or {' '.join(parts)})"),
            inner.map(lambda part: f"(not {part})"),
            st.tuples(inner, inner).map(lambda pair: f"(imply {pair[0]} {pair[1]})"),
            st.tuples(st.sampled_from(["exists", "forall"]), atoms([*names, "?v"])).map(
                lambda pair: f"({pair[0]} (?v - object) {pair[1]})"
            ),
        ),
        max_leaves=4,
    )


def effects_over(names):
    literal = atoms(names) | atoms(names).map(lambda atom: f"(not {atom})")
    quantified = st.tuples(conditions_over([*names, "?w"]), atoms([*names, "?w"])).map(
        lambda pair: f"(forall (?w - object) (when {pair[0]} {pair[1]}))"
    )
    conditional = st.tuples(conditions_over(names), literal).map(lambda pair: f"(when {pair[0]} {pair[1]})")
    return st.lists(literal | conditional | quantified, min_size=1, max_size=3).map(
        lambda parts: f"(and {' '.join(parts)})"
    )


ACTIONS = st.lists(
    st.tuples(conditions_over(["?x", *OBJECTS]), effects_over(["?x", *OBJECTS])), min_size=1, max_size=3
)


@given(actions=ACTIONS, init=st.lists(atoms(OBJECTS), max_size=4), goal=conditions_over(OBJECTS))
def test_plan_is_found_if_and_only_if_problem_is_solvable(actions, init, goal):
    text = "".join(
        f"(:action act{number} :parameters (?x - object) :precondition {condition} :effect {effect})"
        for number, (condition, effect) in enumerate(actions)
    )
    domain = f"""(define (domain d) (:requirements :adl) (:constants {" ".join(OBJECTS)} - object)
      (:predicates (p ?1) (q ?1) (r ?1 ?2) (z)) {text})"""
    solve(domain, f"(define (problem x) (:domain d) (:init {' '.join(init)}) (:goal {goal}))")
