"""Formats the planner calls of a recorded run like PlanSys2's terminal.

The terminal's commands are ``get problem instances``, ``get problem predicates``, ``get problem goal`` and
``get plan``. The terminal separates columns by tabs; here blanks align them, as in figure 9 of the thesis
about fawkesrobotics/ros2-clips-executive (2021). Source:
plansys2_terminal/src/plansys2_terminal/Terminal.cpp.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.errors import TraceError
from cxbridge.events import PlannerCall
from cxbridge.executive.pddl import Domain, Problem, format_formula, parse_domain, parse_problem
from cxbridge.history.plan_steps import PlannedAction, parse_plan_text
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import run_sources

# The sections of a call, in the order of figure 9.
SECTIONS: Final = ("instances", "predicates", "goal", "plan")

# The time between the starts of actions, and their duration, in a plan without times: POPF prints these
# values.
EPSILON_S: Final = 0.001

_ROOT_TYPE: Final = "object"  # the type of PDDL objects without a type
_STARTED: Final = "started"


@dataclass(frozen=True, slots=True)
class PlannerAnswer:
    """The problem and the result of a planner call.

    :param call: the id of the call.
    :param goal: the id of the goal that needs the plan; empty without a result.
    :param end: the last event of the call; None if the recording ends before.
    """

    call: str
    goal: str
    problem: Problem
    end: PlannerCall | None

    def format_section(self, section: str) -> list[str]:
        """Return the lines of a section, one of :data:`SECTIONS`."""
        match section:
            case "instances":
                rows = [
                    (name, group.types[0] if group.types else _ROOT_TYPE)
                    for group in self.problem.objects
                    for name in group.names
                ]
                width = max((len(name) for name, _ in rows), default=0)
                return [f"Instances: {len(rows)}", *(f"  {name:{width}} {type_}" for name, type_ in rows)]
            case "predicates":
                atoms = [format_formula(atom) for atom in self.problem.init]
                return [f"Predicates: {len(atoms)}", *atoms]
            case "goal":
                return [f"Goal: {format_formula(self.problem.goal)}"]
            case _:
                return self._format_plan()

    def _format_plan(self) -> list[str]:
        if self.end is None:
            return ["plan: none yet"]
        if self.end.status != "found":
            return [f"plan: {self.end.status}: {self.end.reason}"]
        rows = _make_plan_rows(parse_plan_text(self.end.plan))
        widths = [max((len(row[column]) for row in rows), default=0) for column in (0, 1)]
        return [
            "plan:",
            *(f"{start:{widths[0]}} {step:{widths[1]}} {duration}" for start, step, duration in rows),
        ]

    def format_sections(self) -> list[str]:
        """Return the lines of all sections, each below its command of PlanSys2's terminal."""
        lines: list[str] = []
        for section in SECTIONS:
            command = "get plan" if section == "plan" else f"get problem {section}"
            lines += ([""] if lines else []) + [f"> {command}", *self.format_section(section)]
        return lines


def _make_plan_rows(actions: Sequence[PlannedAction]) -> list[tuple[str, str, str]]:
    """Return the start, the text and the duration of each action.

    An action without times gets the times that POPF prints.
    """
    rows = []
    for number, action in enumerate(actions):
        begin = number * EPSILON_S if action.start is None else action.start
        duration = EPSILON_S if action.duration is None else action.duration
        rows.append((f"{begin:.6g}", f"({' '.join((action.name, *action.arguments))})", f"{duration:.6g}"))
    return rows


def read_planner_answers(run: Run) -> Iterator[PlannerAnswer]:
    """Yield the planner calls with a recorded problem, in order.

    :raises TraceError: if the recording or a problem cannot be read.
    :raises PddlError: if a problem does not fit its domain.
    """
    ends = {
        (event.env, event.call): event
        for event in run
        if isinstance(event, PlannerCall) and event.status != _STARTED
    }
    # The domains by the owner of the source. A recording has each domain before the problems that use it.
    domains: dict[str, Domain] = {}
    for source in run_sources(run, "pddl"):
        kind, call = source.details.get("kind"), source.details.get("call", "")
        if source.data is None or (kind == "problem" and not call):
            continue  # a problem without a call was only read by the agent
        text, source_name = source.data.decode("utf-8", "replace"), f"{run.path}: {source.name}"
        if kind == "domain":
            domains[source.owner] = parse_domain(text, source_name)
        elif kind == "problem":
            if source.owner not in domains:
                raise TraceError(
                    f"the recording has the problem of {call}, but not its domain", file=run.path
                )
            problem = parse_problem(text, domains[source.owner], source_name)
            final_event = ends.get((source.owner, call))
            yield PlannerAnswer(call, "" if final_event is None else final_event.goal, problem, final_event)


def find_answer(run: Run, name: str = "") -> PlannerAnswer:
    """Return the planner call with this id, or the last call for this goal; without a name, the last call.

    :raises TraceError: if there is no such call.
    """
    answers = list(read_planner_answers(run))
    for answer in reversed(answers):
        if not name or name in (answer.call, answer.goal):
            return answer
    if answers:
        calls = ", ".join(answer.call for answer in answers)
        raise TraceError(f"no planner was called for '{name}'", file=run.path, hint=f"calls: {calls}")
    raise TraceError(
        "no problem of a planner was recorded",
        file=run.path,
        hint="record the run with --trace, with its files, and with an agent that plans",
    )
