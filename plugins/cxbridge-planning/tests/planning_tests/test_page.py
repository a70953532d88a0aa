"""The page about a plan."""

from __future__ import annotations

from cxbridge.cli.main import invoke
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.planning import PlannedAction, PlanResult, PlanStatus
from cxbridge.executive.planning.validation.plan import check_plan
from cxbridge_planning.cli.page import plan_page
from cxbridge_planning.worth import GOAL, Service, services

DOMAIN = """(define (domain d) (:requirements :strips) (:predicates (at ?p) (link ?a ?b) (been ?p))
  (:action go :parameters (?a ?b) :precondition (and (at ?a) (link ?a ?b))
    :effect (and (at ?b) (been ?b) (not (at ?a)))))"""
TASK = "(define (problem p) (:domain d) (:objects a b c) (:init (at a) (link a b) (link b c)) (:goal (at c)))"
STEPS = (PlannedAction("go", ("a", "b")), PlannedAction("go", ("b", "c")))


def result(status=PlanStatus.PLANNED, steps=STEPS, message=""):
    domain = parse_domain(DOMAIN)
    problem = parse_problem(TASK, domain)
    return domain, problem, PlanResult(status, "pyperplan", steps, message)


def test_each_step_serves_a_later_one_or_the_goal():
    domain, problem, planned = result()
    found = services(check_plan(domain, problem, planned.actions))
    assert found == {
        1: [Service(("at", ("b",)), 2)],
        2: [Service(("at", ("c",)), GOAL)],
    }


def test_the_page_has_timeline_states_and_reasons():
    text = plan_page(*result()).render()
    assert text.count("<rect ") == 2
    assert "step 2 (go b c) needs <code>(at b)</code>" in text
    assert "the goal needs <code>(at c)</code>" in text
    assert '<code class="added">(been b)</code>' in text
    assert "2 steps; the plan holds" in text


def test_a_step_that_nothing_needs_is_told():
    loop = (*STEPS, PlannedAction("go", ("c", "c")))
    domain, _, planned = result(steps=loop)
    problem = parse_problem(TASK.replace("(link a b)", "(link a b) (link c c)"), domain)
    text = plan_page(domain, problem, planned).render()
    assert "step 3 (go c c) needs <code>(at c)</code>" in text


def test_without_a_plan_the_page_says_why():
    reason = "pyperplan says that there is no plan: nothing achieves (at <tabel>); nothing deletes (at b)"
    text = plan_page(*result(PlanStatus.NO_PLAN, (), reason)).render()
    assert "<li>nothing achieves (at &lt;tabel&gt;)</li><li>nothing deletes (at b)</li>" in text


def test_the_command_writes_it(tmp_path, capsys):
    for name, text in (("d.pddl", DOMAIN), ("p.pddl", TASK)):
        (tmp_path / name).write_text(text)
    page = tmp_path / "plan.html"
    assert invoke(["plan", str(tmp_path / "d.pddl"), str(tmp_path / "p.pddl"), "--html", str(page)]) == 0
    assert "Plan for p" in page.read_text()
