"""The planning service: planner processes with parallel, slow, cancelled and crashed calls."""

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
# each subset of the objects is a state, and no state has p for all objects
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


def make_request(problem, **settings):
    return PlanRequest(DOMAIN, problem, **{"planner": "pyperplan", **settings})


def wait_for_status(call, seconds=60):
    """Wait for the end of a call, and return the status."""
    result = call.wait(seconds)
    return result.status if result else None


def endless_request(**settings):
    return make_request(ENDLESS, options={"search": "bfs"}, **settings)


def test_service_returns_plan(service):
    result = service.plan(make_request(EASY))
    assert result.status is PlanStatus.PLANNED
    assert [str(step) for step in result.actions] == ["(light)"]
    assert (result.planner, result.message) == ("pyperplan", "")


def test_unsolvable_problem_has_no_plan(service):
    result = service.plan(make_request(IMPOSSIBLE))
    assert result.status is PlanStatus.NO_PLAN
    assert "no plan" in result.message


def test_endless_planner_is_stopped_before_next_plan(service):
    result = service.plan(endless_request(timeout=0.3))
    assert result.status is PlanStatus.TIMEOUT
    assert "0.3 s" in result.message
    assert "give more time, or try the planner auto" in result.message
    assert service.plan(make_request(EASY)).status is PlanStatus.PLANNED


def test_killed_process_gets_no_second_job(monkeypatch):
    """A process that is cancelled at its end is still alive for a moment."""
    run = PlannerProcess.run
    stuck: list[PlannerProcess] = []

    def run_and_cancel(self, job):
        result = run(self, job)
        if not stuck:
            stuck.append(self)
            monkeypatch.setattr(self._process, "poll", lambda: None)  # the process is still alive
            calls[0].cancel()
        return result

    monkeypatch.setattr(PlannerProcess, "run", run_and_cancel)
    with PlanningService(at_once=1) as service:
        calls = [PlanCall(service, make_request(EASY))]
        calls[0].run()
        assert wait_for_status(calls[0], 0) is PlanStatus.CANCELLED
        assert service.plan(make_request(EASY)).status is PlanStatus.PLANNED


def test_planning_recovers_after_failed_start_of_process(service, monkeypatch):
    def refuse(self):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    with monkeypatch.context() as patch:
        patch.setattr(PlannerProcess, "__init__", refuse)
        for _ in range(3):  # more calls than parallel processes
            call = service.call(make_request(EASY))
            assert wait_for_status(call) is PlanStatus.FAILED
            assert "temporarily unavailable" in call.result.message
    assert service.plan(make_request(EASY)).status is PlanStatus.PLANNED


def test_running_call_is_cancelled(service):
    call = service.call(endless_request())
    assert call.result is None
    call.cancel()
    assert wait_for_status(call) is PlanStatus.CANCELLED
    call.cancel()
    assert wait_for_status(call, 0) is PlanStatus.CANCELLED


def test_waiting_call_is_cancelled():
    with PlanningService(at_once=1) as service:
        first, second = service.call(endless_request()), service.call(endless_request())
        second.cancel()
        assert wait_for_status(second) is PlanStatus.CANCELLED
        assert first.result is None


def test_calls_run_in_parallel(service):
    slow = service.call(endless_request())
    assert service.plan(make_request(EASY)).status is PlanStatus.PLANNED
    assert slow.result is None


def test_calls_beyond_limit_wait():
    with PlanningService(at_once=1) as service:
        calls = [service.call(make_request(EASY)) for _ in range(4)]
        assert {wait_for_status(call) for call in calls} == {PlanStatus.PLANNED}


def test_close_cancels_running_and_later_calls():
    service = PlanningService()
    call = service.call(endless_request())
    service.close()
    later_result = service.plan(make_request(EASY))
    assert (wait_for_status(call, 0), later_result.status) == (PlanStatus.CANCELLED, PlanStatus.CANCELLED)
    service.close()


def test_crashed_planner_fails_its_call_only(service):
    call = service.call(endless_request())
    wait_until(lambda: call._process)
    os.kill(call._process._process.pid, signal.SIGSEGV)
    result = call.wait(30)
    assert result.status is PlanStatus.FAILED
    assert "SIGSEGV" in result.message
    assert service.plan(make_request(EASY)).status is PlanStatus.PLANNED


def test_memory_limit_fails_call():
    with PlanningService(memory=200 << 20) as service:
        result = service.plan(endless_request(timeout=60))
    assert result.status is PlanStatus.FAILED
    assert "memory" in result.message


def test_unknown_planners_and_settingsfail_call(service):
    for name, options in (("gps", {}), ("pyperplan", {"depth": "3"})):
        result = service.plan(make_request(EASY, planner=name, options=options))
        assert result.status is PlanStatus.FAILED
        assert result.message


def wait_until(condition):
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)
