"""The engines of unified-planning (extra `planners`)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from msgspec.structs import replace

from cxbridge.executive.pddl import Domain, Problem, parse_domain, parse_problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning import PlanningError, PlanningService, PlanRequest, PlanStatus
from cxbridge_planning.engines.texts import read_task
from cxbridge_planning.engines.unified import ENGINES, UnifiedPlanner, _avoid_spaces
from cxbridge_planning.needs import problem_needs
from cxbridge_planning.registry import make_planner
from planning_tests.compile.test_grounding import FETCH, START, make_problem
from planning_tests.interpreter import World

INSTALLED = [name for name in ENGINES if not UnifiedPlanner(name).unavailable_reason]
pytestmark = [
    pytest.mark.skipif(not INSTALLED, reason="pip install 'cxbridge-planning[engines]'"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # warnings of unified-planning
]

needs_fast_downward = pytest.mark.skipif(
    bool(make_planner("fast-downward").unavailable_reason), reason="pip install up-fast-downward"
)

STRIPS = """(define (domain Rooms) (:requirements :strips :typing) (:types Room)
  (:predicates (At ?r - Room) (Door ?a ?b - Room))
  (:action Go :parameters (?a ?b - Room) :precondition (and (At ?a) (Door ?a ?b))
    :effect (and (At ?b) (not (At ?a)))))"""
ROOMS = """(define (problem x) (:domain Rooms) (:objects K1 k2 k3 - Room)
  (:init (At K1) (Door K1 k2) (Door k2 k3)) (:goal (At k3)))"""

TEMPORAL = """(define (domain t) (:requirements :durative-actions) (:predicates (ready) (done) (idle))
  (:durative-action prepare :parameters () :duration (= ?duration 2) :condition (at start (idle))
    :effect (and (at start (not (idle))) (at end (ready)) (at end (idle))))
  (:durative-action work :parameters () :duration (= ?duration 3)
    :condition (and (at start (ready)) (at start (idle)))
    :effect (and (at start (not (idle))) (at end (done)) (at end (idle)))))"""


@pytest.fixture(scope="module")
def service() -> Iterator[PlanningService]:
    """Run engines in processes of a service, which removes the server and the files of aries."""
    with PlanningService(at_once=1) as planning_service:
        yield planning_service


def solve(
    service: PlanningService, name: str, domain: Domain, problem: Problem
) -> tuple[PlannedAction, ...] | None:
    """Return the plan, or None if the engine finds that no plan exists."""
    result = service.plan(PlanRequest(domain, problem, name))
    assert result.status is not PlanStatus.FAILED, result.message
    return result.actions if result.status is PlanStatus.PLANNED else None


@pytest.mark.parametrize("name", INSTALLED)
def test_plan_keeps_case_of_names(service, name):
    domain = parse_domain(STRIPS)
    plan = solve(service, name, domain, parse_problem(ROOMS, domain))
    assert plan
    assert [str(step) for step in plan] == ["(Go K1 k2)", "(Go k2 k3)"]


@needs_fast_downward
def test_fast_downward_solves_adl_problem(service):
    domain = parse_domain(FETCH)
    task = parse_problem(make_problem("(and (full c1) (at c1 p) (not (full c2)))", START), domain)
    assert make_planner("fast-downward").refusal_reason(problem_needs(domain, task)) == ""
    assert World(domain, task).is_solution(solve(service, "fast-downward", domain, task))


@needs_fast_downward
def test_unsolvable_problem_has_no_plan(service):
    domain = parse_domain(STRIPS)
    task = parse_problem(ROOMS.replace("(Door k2 k3)", ""), domain)
    assert solve(service, "fast-downward", domain, task) is None


@pytest.mark.parametrize("name", INSTALLED)
def test_temporal_plan_has_times(service, name):
    domain = parse_domain(TEMPORAL)
    task = parse_problem("(define (problem x) (:domain t) (:init (idle)) (:goal (done)))", domain)
    plan = solve(service, name, domain, task)
    assert plan
    (first, first_start, first_duration), (second, start, duration) = [
        (step.name, step.start or 0.0, step.duration) for step in plan
    ]
    assert (first, first_duration, second, duration) == ("prepare", 2.0, "work", 3.0)
    assert start >= first_start + 2.0


def test_unreadable_problem_is_refused_with_place(monkeypatch):
    """The error has the place in the user's text, although the engine tried the common forms, too."""
    domain = parse_domain(STRIPS, "rooms.pddl")
    task = parse_problem(ROOMS, domain, "x.pddl")
    monkeypatch.setattr("cxbridge_planning.engines.texts.format_domain", lambda _: "(define")
    broken = replace(domain, text=STRIPS.replace(":action", ":acton"))
    with pytest.raises(PlanningError, match="cannot read the problem") as caught:
        UnifiedPlanner(INSTALLED[0]).solve(broken, task)
    assert (caught.value.file, caught.value.line) == ("rooms.pddl", 3)
    misspelt = replace(task, text=ROOMS.replace(":goal", ":gaol"))
    with pytest.raises(PlanningError, match="cannot read the problem") as caught:
        UnifiedPlanner(INSTALLED[0]).solve(domain, misspelt)
    assert (caught.value.file, caught.value.line) == ("x.pddl", 2)


def test_nested_forall_is_read_in_common_forms():
    domain = parse_domain("""(define (domain d) (:requirements :adl) (:types row - object column - object)
      (:predicates (clean ?r - row ?c - column))
      (:action mop :effect (forall (?r - row) (forall (?c - column) (clean ?r ?c)))))""")
    text = "(define (problem p) (:domain d) (:objects a - row b - column) (:init) (:goal (clean a b)))"
    (mop,) = read_task(domain, parse_problem(text, domain)).actions
    assert len(mop.effects) == 1


def test_engine_in_folder_with_blank_gets_link(tmp_path, monkeypatch):
    """up-aries splits its command line at blanks."""
    monkeypatch.chdir(tmp_path)
    engine = SimpleNamespace(_executable=str(tmp_path / "my robot" / "aries"))
    program = engine._executable
    for _ in range(2):  # the engines for improvement and for solution
        engine._executable = program
        _avoid_spaces(engine)
        assert engine._executable == "./engine"
        assert str(Path("engine").readlink()) == program


def test_missing_packages_of_engine_are_named(monkeypatch):
    monkeypatch.setattr("cxbridge_planning.engines.unified.find_spec", lambda _module: None)
    assert UnifiedPlanner("aries").unavailable_reason.endswith(" -m pip install unified-planning up-aries")
