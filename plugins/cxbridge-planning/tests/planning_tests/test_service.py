"""Planners in separate processes: several at once, too slow, cancelled, crashing, printing."""

from __future__ import annotations

import os
import signal
import time

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import (
    PlanCall,
    PlanningService,
    PlanRequest,
    PlanStatus,
)
from cxbridge_planning.service.process import PlannerProcess

DOMAIN = parse_domain("""(define (domain d) (:requirements :adl) (:predicates (p ?x) (lit))
  (:action light :parameters () :precondition (not (lit)) :effect (lit))
  (:action swap :parameters (?x ?y) :precondition (p ?x) :effect (and (not (p ?x)) (p ?y))))""")
EASY = parse_problem("(define (problem e) (:domain d) (:init) (:goal (lit)))", DOMAIN)
IMPOSSIBLE = parse_problem("(define (problem i) (:domain d) (:objects a b) (:init) (:goal (p a)))", DOMAIN)
OBJECTS = " ".join(f"o{number}" for number in range(60))
# every subset of the objects is a state, and none of them has p for all
ENDLESS = parse_problem(
    f"""(define (problem h) (:domain d) (:objects {OBJECTS}) (:init {"".join(f"(p o{n})" for n in range(30))})
      (:goal (forall (?x) (p ?x))))""",
    DOMAIN,
)
TWO_STEPS = parse_problem(
    "(define (problem t) (:domain d) (:objects o1 o2) (:init (p o1)) (:goal (and (lit) (p o2))))", DOMAIN
)


@pytest.fixture
def service():
    with PlanningService() as service:
        yield service


def request(problem, **more):
    return PlanRequest(DOMAIN, problem, **{"planner": "pyperplan", **more})


def status(call, seconds=60):
    """How a call ended."""
    result = call.wait(seconds)
    return result.status if result else None


def forever(**more):
    return request(ENDLESS, options={"search": "bfs"}, **more)


def test_a_plan(service):
    result = service.plan(request(EASY))
    assert result.status is PlanStatus.PLANNED
    assert [str(step) for step in result.actions] == ["(light)"]
    assert (result.planner, result.message) == ("pyperplan", "")


def test_no_plan(service):
    result = service.plan(request(IMPOSSIBLE))
    assert result.status is PlanStatus.NO_PLAN
    assert "no plan" in result.message


def test_a_planner_that_runs_for_ever_is_stopped_and_the_next_plan_is_made(service):
    result = service.plan(forever(timeout=0.3))
    assert result.status is PlanStatus.TIMEOUT
    assert "0.3 s" in result.message
    assert "give more time, or try the planner auto" in result.message
    assert service.plan(request(EASY)).status is PlanStatus.PLANNED


def test_a_process_that_was_killed_gets_no_other_plan(monkeypatch):
    """One that is given up when it is just done lives on for a moment."""
    run = PlannerProcess.run
    stuck: list[PlannerProcess] = []

    def run_and_give_up(self, job):
        result = run(self, job)
        if not stuck:
            stuck.append(self)
            monkeypatch.setattr(self._process, "poll", lambda: None)  # not dead yet
            calls[0].cancel()
        return result

    monkeypatch.setattr(PlannerProcess, "run", run_and_give_up)
    with PlanningService(at_once=1) as service:
        calls = [PlanCall(service, request(EASY))]
        calls[0].run()
        assert status(calls[0], 0) is PlanStatus.CANCELLED
        assert service.plan(request(EASY)).status is PlanStatus.PLANNED


def test_without_processes_planning_fails_and_goes_on_later(service, monkeypatch):
    def refuse(self):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    with monkeypatch.context() as patch:
        patch.setattr(PlannerProcess, "__init__", refuse)
        for _ in range(3):  # more than may run at once
            call = service.call(request(EASY))
            assert status(call) is PlanStatus.FAILED
            assert "temporarily unavailable" in call.result.message
    assert service.plan(request(EASY)).status is PlanStatus.PLANNED


def test_giving_up(service):
    call = service.call(forever())
    assert call.result is None
    call.cancel()
    assert status(call) is PlanStatus.CANCELLED
    call.cancel()
    assert status(call, 0) is PlanStatus.CANCELLED


def test_giving_up_what_waits_for_a_process():
    with PlanningService(at_once=1) as service:
        first, second = service.call(forever()), service.call(forever())
        second.cancel()
        assert status(second) is PlanStatus.CANCELLED
        assert first.result is None


def test_several_at_once(service):
    slow = service.call(forever())
    assert service.plan(request(EASY)).status is PlanStatus.PLANNED
    assert slow.result is None


def test_more_than_may_run_at_once_wait():
    with PlanningService(at_once=1) as service:
        calls = [service.call(request(EASY)) for _ in range(4)]
        assert {status(call) for call in calls} == {PlanStatus.PLANNED}


def test_closing_cancels():
    service = PlanningService()
    call = service.call(forever())
    service.close()
    assert status(call, 0) is PlanStatus.CANCELLED
    service.close()


def test_a_planner_that_crashes(service):
    call = service.call(forever())
    eventually(lambda: call._process)
    os.kill(call._process._process.pid, signal.SIGSEGV)
    result = call.wait(30)
    assert result.status is PlanStatus.FAILED
    assert "SIGSEGV" in result.message
    assert service.plan(request(EASY)).status is PlanStatus.PLANNED


def test_memory_is_bounded():
    with PlanningService(memory=200 << 20) as service:
        result = service.plan(forever(timeout=60))
    assert result.status is PlanStatus.FAILED
    assert "memory" in result.message


def test_unknown_planners_and_options_fail(service):
    for name, options in (("gps", {}), ("pyperplan", {"depth": "3"})):
        result = service.plan(request(EASY, planner=name, options=options))
        assert result.status is PlanStatus.FAILED
        assert result.message


def eventually(condition):
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)
