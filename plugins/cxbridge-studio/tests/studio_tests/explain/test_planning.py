"""The requests to a planner in a recorded run, in the form of PlanSys2's terminal."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.cli.main import main as cxbridge
from cxbridge.errors import TraceError
from cxbridge.events import PlannerCall
from cxbridge.executive.pddl import parse_domain, parse_formula, problem_of_facts
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.explain.planning import PlannerAnswer, find_answer, read_planner_answers
from tests.support import ROOT, ROS2CX_DIR, SHARED, needs_plugin, needs_ros2cx, needs_shared


def main(arguments):
    """Run a command; return its exit status."""
    with pytest.raises(SystemExit) as ended:
        cxbridge(arguments)
    return ended.value.code or 0


MEET = ROOT / "scenarios" / "test-scenario-pddl"
THESIS = SHARED / "000_07220b73fac57e98.txt"
STEP = re.compile(r"[\d.]+ +(\(.*\)) +[\d.]+")

DOMAIN = parse_domain(
    """(define (domain d) (:requirements :strips :typing) (:types robot place)
    (:predicates (at ?r - robot ?p - place))
    (:action move :parameters (?r - robot ?a - place ?b - place)
      :precondition (at ?r ?a) :effect (and (at ?r ?b) (not (at ?r ?a)))))"""
)


def answer(plan: str, status: str = "found", reason: str = "") -> PlannerAnswer:
    problem = problem_of_facts(
        DOMAIN,
        [("r", "robot"), ("here", "place"), ("there", "place")],
        [("at", ("r", "here"))],
        parse_formula("(and (at r there))"),
    )
    count = len(plan.splitlines())
    event = PlannerCall(0, "e", "c", "G", "pyperplan", "d", "", status, 1, count, reason, plan)
    return PlannerAnswer("c", "G", problem, event)


def test_each_section_has_the_form_of_the_terminal():
    assert answer("(move r here there)\n(move r there here)").format_sections() == [
        "> get problem instances",
        "Instances: 3",
        "  r     robot",
        "  here  place",
        "  there place",
        "",
        "> get problem predicates",
        "Predicates: 1",
        "(at r here)",
        "",
        "> get problem goal",
        "Goal: (and (at r there))",
        "",
        "> get plan",
        "plan:",
        "0     (move r here there) 0.001",
        "0.001 (move r there here) 0.001",
    ]


def test_a_plan_with_times_keeps_them():
    assert answer("0.0: (move r here there) [2.5]\n2.5: (move r there here) [10.0]").format_section(
        "plan"
    ) == [
        "plan:",
        "0   (move r here there) 2.5",
        "2.5 (move r there here) 10",
    ]


def test_no_plan_says_why():
    assert answer("", "none", "the goal cannot be reached").format_section("plan") == [
        "plan: none: the goal cannot be reached"
    ]


@pytest.fixture(scope="module")
def meeting(tmp_path_factory) -> Path:
    file: Path = tmp_path_factory.mktemp("planned") / "run.mcap"
    assert run_scenario(RunOptions(scenario=MEET, trace=file)).status == 0
    return file


def test_a_recording_has_the_problem_of_each_call(meeting, capsys):
    assert main(["trace", "planning", str(meeting), "goal"]) == 0
    assert capsys.readouterr().out.startswith("Goal: (")
    assert main(["trace", "planning", str(meeting), "predicates"]) == 0
    predicates = capsys.readouterr().out.splitlines()
    assert predicates[0] == f"Predicates: {len(predicates) - 1}"
    run = open_run(meeting)
    assert [each.goal for each in read_planner_answers(run)] == [
        event.goal for event in run if isinstance(event, PlannerCall) and event.status == "found"
    ]


@needs_plugin("planning")
def test_the_recorded_problem_can_be_planned_again(meeting, tmp_path, capsys):
    assert main(["trace", "extract", str(meeting), "pddl/*", "-o", str(tmp_path)]) == 0
    (problem,) = (tmp_path / "pddl").glob("plan-*.pddl")
    capsys.readouterr()
    assert main(["plan", str(MEET / "domain.pddl"), str(problem)]) == 0
    steps = capsys.readouterr().out.splitlines()
    assert [
        STEP.sub(r"\1", line) for line in find_answer(open_run(meeting)).format_section("plan")[1:]
    ] == steps


def test_a_call_that_there_was_not(meeting):
    with pytest.raises(TraceError, match="no planner was called for 'NOBODY'"):
        find_answer(open_run(meeting), "NOBODY")


def test_a_recording_without_problems(tmp_path):
    file = tmp_path / "run.mcap"
    run_scenario(RunOptions(scenario=MEET, trace=file, trace_files=False))
    with pytest.raises(TraceError, match="no problem of a planner was recorded"):
        find_answer(open_run(file))


def test_a_part_that_there_is_not(meeting, capsys):
    assert main(["trace", "planning", str(meeting), "axioms"]) == 2
    assert "one of instances, predicates, goal, plan" in capsys.readouterr().err


@needs_ros2cx
@needs_shared
def test_figure_9_of_the_thesis(tmp_path, capsys):
    """Character by character; in the plan's lines the times, and the blanks around them, are left out."""
    figure = re.search(r"^> get problem instances\n.*?(?=^```)", THESIS.read_text(), re.DOTALL | re.MULTILINE)
    assert figure is not None
    file = tmp_path / "run.mcap"
    assert (
        run_scenario(options_from_keywords(None, ros2cx=ROS2CX_DIR, spec="test-nav2", trace=file)).status == 0
    )
    assert main(["trace", "planning", str(file)]) == 0
    there, ours = figure[0].splitlines(), capsys.readouterr().out.splitlines()
    assert [STEP.sub(r"\1", line) for line in ours] == [STEP.sub(r"\1", line) for line in there]
    assert ours[: there.index("plan:") + 1] == there[: there.index("plan:") + 1]
    assert len(ours) - ours.index("plan:") - 1 == 7
