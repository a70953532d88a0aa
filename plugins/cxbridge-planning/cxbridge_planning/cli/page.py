"""The HTML page about a plan: its steps, their changes, and the later steps that they serve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cxbridge.executive.pddl import Domain, Problem, format_formula
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.pddl.printer import format_number
from cxbridge.executive.planning import PlannedAction, PlanResult
from cxbridge.executive.planning.validation.plan import PlanCheck, PlanMoment, check_plan
from cxbridge.executive.planning.validation.world import WorldState
from cxbridge.run.pages import write_document
from cxbridge_planning.worth import Service, find_services, metric_value


def write_page(path: Path, domain: Domain, problem: Problem, result: PlanResult) -> None:
    """Write the page about a planner's result."""
    write_document(path, "plan", f"Plan for {problem.name}", make_document(domain, problem, result))


def make_document(domain: Domain, problem: Problem, result: PlanResult) -> dict[str, Any]:
    """Return the content of the page as JSON values."""
    check = check_plan(domain, problem, result.actions)
    facts = {
        "problem": problem.name,
        "planner": result.planner,
        "time": f"{result.seconds:.2f} s",
        "goal": format_formula(problem.goal),
        "why this planner": result.why,
        "result": result.message or _format_result(problem, result.actions, check),
    }
    planned = result.status.value == "PLANNED"
    # without a plan, the message has the form ``CLAIM: REASON; REASON``
    reasons = result.message.partition(": ")[2].split("; ")
    return {
        "facts": {name: text for name, text in facts.items() if text},
        "reasons": None if planned else [reason for reason in reasons if reason],
        "begin": _format_state(check.begin),
        "steps": _make_step_rows(result.actions, check) if planned else [],
    }


def _format_result(problem: Problem, actions: Sequence[PlannedAction], check: PlanCheck) -> str:
    metric = metric_value(problem, actions, check)
    cost = "" if metric is None else f", metric {metric:g}"
    return check.failure or check.unchecked or f"{len(actions)} steps{cost}; the plan holds"


def _make_step_rows(actions: Sequence[PlannedAction], check: PlanCheck) -> list[dict[str, Any]]:
    services_of_steps = find_services(check)
    moments: dict[int, list[PlanMoment]] = {}
    for moment in check.moments:
        moments.setdefault(moment.step, []).append(moment)
    return [
        {
            "action": " ".join((action.name, *action.arguments)),
            "text": str(action),
            "start": action.start,
            "duration": action.duration,
            "changes": [_make_change_row(moment) for moment in moments.get(number, ()) if moment.changes],
            "serves": _make_service_rows(services_of_steps.get(number, ())),
            "after": _format_state(moments[number][-1].after) if number in moments else None,
        }
        for number, action in enumerate(actions, start=1)
    ]


def _make_change_row(moment: PlanMoment) -> dict[str, Any]:
    return {
        "part": moment.part,
        "added": [_format_fact(fact) for fact in sorted(moment.changes.adds)],
        "deleted": [_format_fact(fact) for fact in sorted(moment.changes.deletes)],
        "numbers": _format_numbers(moment.changes.numbers),
    }


def _make_service_rows(services_of_step: Sequence[Service]) -> list[dict[str, Any]]:
    by_step: dict[int, list[str]] = {}
    for service in services_of_step:
        by_step.setdefault(service.step, []).append(_format_fact(service.fact))
    return [{"step": step, "facts": facts} for step, facts in by_step.items()]


def _format_state(state: WorldState) -> list[str]:
    return [*(_format_fact(fact) for fact in sorted(state.facts)), *_format_numbers(state.numbers)]


def _format_numbers(numbers: Mapping[Ground, float]) -> list[str]:
    return [f"{_format_fact(ground)} = {format_number(value)}" for ground, value in sorted(numbers.items())]


def _format_fact(ground: Ground) -> str:
    return f"({' '.join((ground[0], *ground[1]))})"
