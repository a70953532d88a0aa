"""Planner programs of installed packages, and scripts in place of programs on the PATH."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import PlanningService, PlanRequest, PlanStatus, UnknownPlannerError
from cxbridge_planning.engines.programs import PROGRAMS
from cxbridge_planning.registry import make_planner
from planning_tests import test_attempts
from planning_tests.test_service import DOMAIN, ENDLESS, TWO_STEPS, wait_for_status, wait_until

ROOMS = parse_domain("""(define (domain rooms) (:requirements :strips :typing :action-costs) (:types room)
  (:predicates (at ?r - room) (door ?a ?b - room)) (:functions (total-cost) - number)
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (door ?a ?b))
    :effect (and (at ?b) (not (at ?a)) (increase (total-cost) 1))))""")
TASK = """(define (problem x) (:domain rooms) (:objects k1 k2 k3 - room)
  (:init (at k1) (door k1 k2) (door k2 k3) (= (total-cost) 0)) (:goal (at {goal})) {metric})"""


@pytest.mark.parametrize("name", [name for name, each in PROGRAMS.items() if each.package])
@pytest.mark.parametrize("metric", ["", "(:metric minimize (total-cost))"])
def test_packaged_program_finds_plan(name, metric):
    if missing := make_planner(name).unavailable_reason:
        pytest.skip(missing)
    problem = parse_problem(TASK.format(goal="k3", metric=metric), ROOMS)
    with PlanningService() as service:
        result = service.plan(PlanRequest(ROOMS, problem, name))
    assert [str(step) for step in result.actions] == ["(go k1 k2)", "(go k2 k3)"], result.message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"x": "y"}, "planner fast-downward has no options x"),
        ({"options": '"open'}, "the options of planner fast-downward are invalid: No closing quotation"),
    ],
)
def test_wrong_options_of_program_are_refused(options, message):
    with pytest.raises(UnknownPlannerError, match=message):
        make_planner("fast-downward", options)


# ---- programs on the PATH


@pytest.fixture
def service():
    with PlanningService() as service:
        yield service


@pytest.fixture
def add_program(tmp_path, monkeypatch):
    """Return a function that puts a shell script on the PATH."""

    def add(name, script):
        path = tmp_path / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    return add


FF = """cat <<END
ff: found legal plan as follows

step    0: LIGHT
        1: SWAP O1 O2
        2: REACH-GOAL

time spent:    0.00 seconds instantiating 1 easy, 0 hard action templates
END"""


def test_upper_case_output_of_ff_is_read(add_program, service):
    add_program("ff", FF)
    result = service.plan(PlanRequest(DOMAIN, TWO_STEPS, "ff"))
    assert [str(step) for step in result.actions] == ["(light)", "(swap o1 o2)"]


def test_output_of_fast_downward_program_is_read(add_program, service):
    text = "Solution found!\nActual search time: 0.1s\nlight  (1)\nswap o1 o2 (1)\nPlan length: 2 step(s).\n"
    add_program("fast-downward", f"printf '{text}'".replace("\n", "\\n"))
    result = service.plan(PlanRequest(DOMAIN, TWO_STEPS, "fd"))
    assert [str(step) for step in result.actions] == ["(light)", "(swap o1 o2)"]


@pytest.mark.parametrize(
    ("script", "expected_status", "message"),
    [
        ("echo rubbish; exit 3", PlanStatus.FAILED, "exit status 3 and without a plan: rubbish"),
        ("echo 'ff: goal can be simplified to FALSE'", PlanStatus.NO_PLAN, "no plan"),
        (FF.replace("O2", "MOON"), PlanStatus.FAILED, "an object that does not exist: MOON"),
        (FF.replace("SWAP", "FLY"), PlanStatus.FAILED, "an action that does not exist: FLY"),
        ("kill -9 $$", PlanStatus.FAILED, "without a plan"),
        (FF.replace("LIGHT", "SWAP O1 O2"), PlanStatus.FAILED, "step 2, (swap o1 o2): (p o1) is false"),
        (
            FF,
            PlanStatus.FAILED,
            "ff made an invalid plan: the goal is not reached: (p o1) is false",
        ),
    ],
)
def test_program_without_valid_plan_gives_status_and_reason(
    add_program, service, script, expected_status, message
):
    add_program("ff", script)
    result = service.plan(PlanRequest(DOMAIN, ENDLESS, "ff"))
    assert result.status is expected_status
    assert message in result.message


def test_hanging_program_is_killed(add_program, service, tmp_path):
    add_program("ff", f"echo $$ > '{tmp_path}/pid'; exec sleep 1000")
    call = service.call(PlanRequest(DOMAIN, ENDLESS, "ff"))
    wait_until(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text().endswith("\n"))
    call._end_call(PlanStatus.TIMEOUT)  # the effect of the timer
    assert wait_for_status(call) is PlanStatus.TIMEOUT
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not is_running(pid))


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_temporal_plan_of_program_has_times(add_program, service):
    add_program("popf", "printf ';;;; Solution Found\\n; Cost: 4\\n0.000: (work)  [3.000]\\n'")
    (step,) = service.plan(PlanRequest(test_attempts.DOMAIN, test_attempts.PROBLEM, "popf")).actions
    assert (step.start, step.duration, str(step)) == (0.0, 3.0, "0.000: (work) [3.000]")


def test_timeout_returns_best_plan_so_far(tmp_path, service):
    script = tmp_path / "improves"
    script.write_text(
        """#!/bin/sh
        while [ "$1" != -out ]; do shift; done
        printf '(go k1 k2)\n(go k2 k1)\n(go k1 k2)\n(go k2 k3)\n' > "$2_1.SOL"
        sleep 0.1
        printf '(go k1 k2)\n(go k2 k3)\n' > "$2_2.SOL"
        exec sleep 1000
        """
    )
    script.chmod(0o755)
    problem = parse_problem(TASK.format(goal="k3", metric="(:metric minimize (total-cost))"), ROOMS)
    result = service.plan(PlanRequest(ROOMS, problem, "lpg", {"program": str(script)}, timeout=2.0))
    assert (result.status, result.planner) == (PlanStatus.PLANNED, "lpg"), result.message
    assert [str(step) for step in result.actions] == ["(go k1 k2)", "(go k2 k3)"]
    assert "the time limit was reached" in result.why
