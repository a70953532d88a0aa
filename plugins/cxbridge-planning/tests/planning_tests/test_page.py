"""The page about a plan."""

from __future__ import annotations

from cxbridge.cli.main import invoke
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.planning import PlannedAction, PlanResult, PlanStatus
from cxbridge.executive.planning.validation.plan import check_plan
from cxbridge_planning.cli.page import make_document
from cxbridge_planning.worth import GOAL, Service, find_services
from tests.support import needs_plugin
from tests.trace.html.browser import needs_browser, show

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
    found = find_services(check_plan(domain, problem, planned.actions))
    assert found == {
        1: [Service(("at", ("b",)), 2)],
        2: [Service(("at", ("c",)), GOAL)],
    }


def test_the_page_has_timeline_states_and_reasons():
    document = make_document(*result())
    first, second = document["steps"]
    assert (first["action"], first["start"]) == ("go a b", None)
    assert first["serves"] == [{"step": 2, "facts": ["(at b)"]}]
    assert second["serves"] == [{"step": GOAL, "facts": ["(at c)"]}]
    change = {"part": "", "added": ["(at b)", "(been b)"], "deleted": ["(at a)"], "numbers": []}
    assert first["changes"] == [change]
    assert document["begin"] == ["(at a)", "(link a b)", "(link b c)"]
    assert set(second["after"]) == {"(at c)", "(been b)", "(been c)", "(link a b)", "(link b c)"}
    assert document["facts"]["result"] == "2 steps; the plan holds"


def test_a_step_that_nothing_needs_is_told():
    loop = (*STEPS, PlannedAction("go", ("c", "c")))
    domain, _, planned = result(steps=loop)
    problem = parse_problem(TASK.replace("(link a b)", "(link a b) (link c c)"), domain)
    steps = make_document(domain, problem, planned)["steps"]
    assert steps[1]["serves"] == [{"step": 3, "facts": ["(at c)"]}]


def test_without_a_plan_the_page_says_why():
    reason = "pyperplan says that there is no plan: nothing achieves (at <tabel>); nothing deletes (at b)"
    document = make_document(*result(PlanStatus.NO_PLAN, (), reason))
    assert document["reasons"] == ["nothing achieves (at <tabel>)", "nothing deletes (at b)"]
    assert document["steps"] == []


@needs_plugin("web")
@needs_browser
def test_the_command_writes_it(tmp_path, capsys):
    for name, text in (("d.pddl", DOMAIN), ("p.pddl", TASK)):
        (tmp_path / name).write_text(text)
    page = tmp_path / "plan.html"
    assert invoke(["plan", str(tmp_path / "d.pddl"), str(tmp_path / "p.pddl"), "--html", str(page)]) == 0
    shown = show(page, tmp_path / "profile")
    assert shown.console == []
    assert shown.dom.count("<rect ") == 2
    assert "step 2 (go b c) needs <code>(at b)</code>" in shown.dom
    assert '<code class="added">(been b)</code>' in shown.dom
