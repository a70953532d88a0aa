"""Makes the page about a plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from cxbridge.executive.pddl import Domain, Problem, format_formula
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.pddl.printer import format_number
from cxbridge.executive.planning import PlannedAction, PlanResult
from cxbridge.executive.planning.validation.plan import PlanCheck, PlanMoment, check_plan
from cxbridge.executive.planning.validation.world import WorldState
from cxbridge.trace.html.page import Page, Section, asset
from cxbridge.trace.html.parts import notes, pairs, table
from cxbridge.trace.html.text import html
from cxbridge_planning.worth import GOAL, Service, services, value_of_metric

_WIDTH: Final = 1000
_ROW: Final = 22
_LABEL: Final = 300
_MOST_ROWS: Final = 500
"""Steps that are drawn and listed; a browser is slow with more."""


def plan_page(domain: Domain, problem: Problem, result: PlanResult) -> Page:
    """Return a page about the result of a planner."""
    check = check_plan(domain, problem, result.actions)
    facts = {
        "problem": problem.name,
        "planner": result.planner,
        "time": f"{result.seconds:.2f} s",
        "goal": format_formula(problem.goal),
        "why this planner": result.why,
        "result": result.message or _summary(problem, result.actions, check),
    }
    lead = pairs({name: text for name, text in facts.items() if text})
    sections = (
        list(_sections(result.actions, check)) if result.status.value == "PLANNED" else _no_plan(result)
    )
    return Page(f"Plan for {problem.name}", lead, sections=sections, styles=[asset("plan.css", __package__)])


def _summary(problem: Problem, actions: Sequence[PlannedAction], check: PlanCheck) -> str:
    metric = value_of_metric(problem, actions, check)
    cost = "" if metric is None else f", metric {metric:g}"
    return check.failure or check.unchecked or f"{len(actions)} steps{cost}; the plan holds"


def _no_plan(result: PlanResult) -> list[Section]:
    reasons = result.message.partition(": ")[2].split("; ")
    body = "".join(f"<li>{html(reason)}</li>" for reason in reasons if reason)
    return [Section("reasons", "Why there is no plan", f"<ul>{body}</ul>")]


def _sections(actions: Sequence[PlannedAction], check: PlanCheck) -> Iterator[Section]:
    shown = actions[:_MOST_ROWS]
    more = len(actions) - len(shown)
    note = notes([f"the first {_MOST_ROWS} of {len(actions)} steps"] if more > 0 else [])
    yield Section("timeline", "Timeline", note + _timeline(shown))
    yield Section("steps", "Steps", note + _steps(shown, check))


# ---- the timeline


def _timeline(actions: Sequence[PlannedAction]) -> str:
    spans = [_span(number, action) for number, action in enumerate(actions)]
    end = max((end for _, end in spans), default=1.0) or 1.0
    scale = (_WIDTH - _LABEL) / end
    rows = "".join(
        _bar(number, action, _LABEL + begin * scale, max(2.0, (done - begin) * scale))
        for number, (action, (begin, done)) in enumerate(zip(actions, spans, strict=True))
    )
    height = _ROW * max(1, len(actions))
    unit = "seconds" if any(action.start is not None for action in actions) else "steps"
    title = f"<title>{len(actions)} actions in {end:g} {unit}</title>"
    return f'<svg class="plan" viewBox="0 0 {_WIDTH} {height}" role="img">{title}{rows}</svg>'


def _span(number: int, action: PlannedAction) -> tuple[float, float]:
    if action.start is None:
        return float(number), float(number + 1)
    return action.start, action.start + (action.duration or 0.0)


def _bar(number: int, action: PlannedAction, x: float, width: float) -> str:
    y = number * _ROW
    return (
        f'<line x1="0" x2="{_WIDTH}" y1="{y + _ROW}" y2="{y + _ROW}"/>'
        f'<text x="4" y="{y + _ROW - 7}">{number + 1} {html(_said(action))}</text>'
        f'<rect x="{x:.1f}" y="{y + 4}" width="{width:.1f}" height="{_ROW - 8}" rx="2">'
        f"<title>{html(str(action))}</title></rect>"
    )


def _said(action: PlannedAction) -> str:
    return " ".join((action.name, *action.arguments))


# ---- the steps


def _steps(actions: Sequence[PlannedAction], check: PlanCheck) -> str:
    serving = services(check)
    moments: dict[int, list[PlanMoment]] = {}
    for moment in check.moments:
        moments.setdefault(moment.step, []).append(moment)
    rows = [
        [
            str(number),
            f"<code>{html(str(action))}</code>",
            "".join(map(_changes, moments.get(number, ()))),
            _serves(serving.get(number, ()), actions),
            _state(moments[number][-1].after) if number in moments else "",
        ]
        for number, action in enumerate(actions, start=1)
    ]
    begin = f"<h3>At the start</h3>{_state(check.begin)}"
    return begin + table(["", "step", "changes", "why it is there", "state after it"], rows, numbers=[0])


def _changes(moment: PlanMoment) -> str:
    if not moment.changes:
        return ""
    part = f"{moment.part}: " if moment.part else ""
    added = "".join(
        f'<code class="added">{html(_fact(fact))}</code> ' for fact in sorted(moment.changes.adds)
    )
    deleted = "".join(
        f'<code class="deleted">{html(_fact(fact))}</code> ' for fact in sorted(moment.changes.deletes)
    )
    numbers = "".join(
        f"<code>{html(_fact(ground))} = {format_number(value)}</code> "
        for ground, value in sorted(moment.changes.numbers.items())
    )
    return f'<p class="plain">{part}{added}{deleted}{numbers}</p>'


def _serves(found: Sequence[Service], actions: Sequence[PlannedAction]) -> str:
    if not found:
        return "no step and no goal needs its effects"
    by_step: dict[int, list[str]] = {}
    for service in found:
        by_step.setdefault(service.step, []).append(_fact(service.fact))
    lines = []
    for step, facts in by_step.items():
        said = "the goal" if step == GOAL else f"step {step}"
        if 0 < step <= len(actions):
            said += f" ({_said(actions[step - 1])})"
        lines.append(f"<li>{html(said)} needs <code>{html(', '.join(facts))}</code></li>")
    return f"<ul>{''.join(lines)}</ul>"


def _state(state: WorldState) -> str:
    numbers: Mapping[Ground, float] = state.numbers
    facts = [_fact(fact) for fact in sorted(state.facts)]
    facts += [f"{_fact(ground)} = {format_number(value)}" for ground, value in sorted(numbers.items())]
    body = " ".join(f"<code>{html(fact)}</code>" for fact in facts)
    return f'<details><summary>{len(facts)} facts</summary><p class="plain">{body}</p></details>'


def _fact(ground: Ground) -> str:
    return f"({' '.join((ground[0], *ground[1]))})"
