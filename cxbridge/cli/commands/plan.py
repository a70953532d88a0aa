"""`cxbridge plan`: call a planner."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from cxbridge.cli.console import say, say_json, say_text
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file

if TYPE_CHECKING:
    from cxbridge.executive.planning import PlanResult

EXIT: Final = {"PLANNED": 0, "NO-PLAN": 1, "TIMEOUT": 3, "FAILED": 4, "CANCELLED": 130}
"""Exit status by how planning ended; bad input and planners that refuse the problem are 2."""


def plan(
    domain_file: Annotated[Path | None, typer.Argument(metavar="DOMAIN", help="PDDL domain.")] = None,
    problem_file: Annotated[Path | None, typer.Argument(metavar="PROBLEM", help="PDDL problem.")] = None,
    planner: Annotated[str, typer.Option(help="Planner; see --list.")] = "auto",
    timeout: Annotated[float, typer.Option(min=0.001, help="Seconds that planning may take.")] = 60.0,
    option: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", help="An option of the planner. Repeatable.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the plan here.")] = None,
    list_planners: Annotated[bool, typer.Option("--list", help="List the planners and stop.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Make a plan for a PDDL problem, and print it a step a line.

    Exit status: 0 a plan, 1 there is none, 2 bad input or a planner that cannot take the problem, 3 out of
    time, 4 the planner failed.

    Example: cxbridge plan domain.pddl problem.pddl --planner pyperplan
    """
    if list_planners:
        _list(as_json=as_json)
        return 0
    if domain_file is None or problem_file is None:
        raise CxbridgeError("domain and problem are missing", hint="cxbridge plan domain.pddl problem.pddl")
    result = _plan(domain_file, problem_file, planner, _options(option or []), timeout)
    if result.message:
        say(f"cxbridge: {result.message}", err=True)
    steps = "".join(f"{action}\n" for action in result.actions)
    if output is not None and result.status.value == "PLANNED":
        write_file(output, steps)
    if as_json:
        say_json(_as_json(result), indent=2)
    elif output is None:
        say_text(steps, end="")
    return EXIT[result.status.value]


def _plan(
    domain_file: Path, problem_file: Path, planner: str, options: dict[str, str], timeout: float
) -> PlanResult:
    from cxbridge.executive.pddl import load_domain, load_problem
    from cxbridge.executive.planning import PlanningService, PlanRequest
    from cxbridge.executive.planning.engines.registry import choose_planner

    domain = load_domain(domain_file)
    problem = load_problem(problem_file, domain)
    name = choose_planner(planner, domain, problem, options).name
    with PlanningService(at_once=1) as service:
        return service.plan(PlanRequest(domain, problem, name, options, timeout))


def _options(texts: list[str]) -> dict[str, str]:
    options = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise CxbridgeError(f"'{text}' is not an option of a planner", hint="write KEY=VALUE")
        options[key] = value
    return options


def _list(*, as_json: bool) -> None:
    from cxbridge.executive.planning.engines.registry import NAMES, make_planner

    rows = [(name, make_planner(name)) for name in NAMES]
    if as_json:
        planners = [
            {
                "name": name,
                "installed": not planner.not_installed,
                "understands": sorted(need.value for need in planner.understands),
            }
            for name, planner in rows
        ]
        say_json(planners, indent=2)
        return
    for name, planner in rows:
        say(f"{name:14}  {planner.not_installed or 'installed'}")


def _as_json(result: PlanResult) -> dict[str, object]:
    return {
        "status": result.status.value,
        "planner": result.planner,
        "seconds": round(result.seconds, 6),
        "message": result.message,
        "actions": [
            {
                "name": step.name,
                "arguments": list(step.arguments),
                "start": step.start,
                "duration": step.duration,
            }
            for step in result.actions
        ],
    }
