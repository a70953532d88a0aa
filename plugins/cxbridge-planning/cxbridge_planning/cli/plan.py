"""`cxbridge plan`: call a planner."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from cxbridge.cli.console import say, say_json, say_text
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.file_access import write_file

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, Problem
    from cxbridge_planning import PlanResult

# The exit status by planning status; bad input and unsupported problems have 2. Shells use 130 for Ctrl-C.
EXIT_STATUS: Final = {"PLANNED": 0, "NO-PLAN": 1, "TIMEOUT": 3, "FAILED": 4, "CANCELLED": 130}


@dataclasses.dataclass(frozen=True, kw_only=True)
class _PlannerOptions:
    """The options for the call of a planner."""

    planner: Annotated[
        str, typer.Option(help="The planner that makes the plan; --list prints the planners.")
    ] = "auto"
    timeout: Annotated[float, typer.Option(min=0.001, help="End planning after this time, in seconds.")] = (
        60.0
    )
    option: Annotated[
        tuple[str, ...],
        typer.Option(metavar="KEY=VALUE", help="Give this option to the planner. Repeatable."),
    ] = ()


@dataclasses.dataclass(frozen=True, kw_only=True)
class _OutputOptions:
    """The options for the output of the result."""

    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the plan to this file.")] = None
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print the planner that was used, and why.")
    ] = False
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False


@option_groups
def plan(
    planner_options: _PlannerOptions,
    output_options: _OutputOptions,
    domain_file: Annotated[
        Path | None, typer.Argument(metavar="DOMAIN", help="The file with the PDDL domain.")
    ] = None,
    problem_file: Annotated[
        Path | None, typer.Argument(metavar="PROBLEM", help="The file with the PDDL problem.")
    ] = None,
    validate: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="Check this plan instead of making one.")
    ] = None,
    strict: Annotated[
        str, typer.Option(metavar="fawkes", help="Read the domain as Fawkes' parser does (docs/planning.md).")
    ] = "",
    list_planners: Annotated[bool, typer.Option("--list", help="List the planners and stop.")] = False,
) -> int:
    """Make a plan for a PDDL problem, and print one step per line.

    Exit status: 0 a plan was found; 1 no plan exists, or the plan of --validate does not hold; 2 bad input,
    or the planner does not support the problem; 3 the time limit was exceeded; 4 the planner failed.

    Example: cxbridge plan domain.pddl problem.pddl --planner pyperplan
    """
    if list_planners:
        _print_planners(as_json=output_options.as_json)
        return 0
    if domain_file is None or problem_file is None:
        raise CxbridgeError("domain and problem are missing", hint="cxbridge plan domain.pddl problem.pddl")
    if strict not in ("", "fawkes"):
        raise CxbridgeError(f"--strict {strict} is unknown", hint="write --strict fawkes")
    as_fawkes = strict == "fawkes"
    if validate is not None:
        domain, problem = _read_files(domain_file, problem_file, as_fawkes=as_fawkes)
        return _validate_plan(domain, problem, validate, as_json=output_options.as_json)
    result = _make_plan(domain_file, problem_file, planner_options, as_fawkes=as_fawkes)
    _print_result(result, planner_options.planner, output_options)
    return EXIT_STATUS[result.status.value]


def _print_result(result: PlanResult, requested_planner: str, options: _OutputOptions) -> None:
    """Print a result, and write its plan to the file of ``--output``."""
    if result.message:
        say(f"cxbridge: {result.message}", err=True)
    if options.verbose:
        outcome = "planned" if result.status.value == "PLANNED" else "found no plan"
        is_automatic = requested_planner == "auto"
        why = result.why or ("the first that supports the problem" if is_automatic else "as requested")
        say(f"cxbridge: {result.planner} {outcome} in {result.seconds:.2f} s; {why}", err=True)
    steps = "".join(f"{action}\n" for action in result.actions)
    if options.output is not None and result.status.value == "PLANNED":
        write_file(options.output, steps)
    if options.as_json:
        say_json(_result_to_json(result), indent=2)
    elif options.output is None:
        say_text(steps, end="")


def _read_files(domain_file: Path, problem_file: Path, *, as_fawkes: bool) -> tuple[Domain, Problem]:
    from cxbridge.executive.pddl import load_domain, load_problem

    def warn(mistake: PddlError) -> None:
        for line in f"cxbridge: warning: {mistake}".splitlines():
            say(line, err=True)

    domain = load_domain(domain_file, fawkes_compat=as_fawkes, warn=warn)
    return domain, load_problem(problem_file, domain, warn=warn)


def _make_plan(
    domain_file: Path, problem_file: Path, options: _PlannerOptions, *, as_fawkes: bool
) -> PlanResult:
    """Read domain and problem while the planner's process starts, then plan."""
    from cxbridge_planning import PlanningService, PlanRequest
    from cxbridge_planning.registry import choose_planners

    planner_settings = _parse_options(options.option)
    with PlanningService(at_once=1) as service:
        service.warm_up()  # the imports of the process take longer than the parser
        domain, problem = _read_files(domain_file, problem_file, as_fawkes=as_fawkes)
        # called for its errors only: an unsupported problem is bad input, not a failure of the planner
        choose_planners(options.planner, domain, problem, planner_settings)
        return service.plan(PlanRequest(domain, problem, options.planner, planner_settings, options.timeout))


def _validate_plan(domain: Domain, problem: Problem, plan_file: Path, *, as_json: bool) -> int:
    """Print whether a plan is valid; return the exit status."""
    from cxbridge_planning.plan_files import PlanNames, load_plan
    from cxbridge_planning.validation.plan import check_plan

    actions = load_plan(plan_file, PlanNames(domain, problem))
    check = check_plan(domain, problem, actions)
    if check.inconclusive_reason:
        raise CxbridgeError(f"the plan cannot be checked: {check.inconclusive_reason}", file=str(plan_file))
    if as_json:
        say_json({"valid": not check.failure, "step": check.step, "message": check.failure}, indent=2)
    elif check.failure:
        say(f"the plan does not hold: {check.failure}")
    else:
        say(f"the plan holds: {len(actions)} steps")
    return 1 if check.failure else 0


def _parse_options(texts: Iterable[str]) -> dict[str, str]:
    options = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise CxbridgeError(f"'{text}' is not an option of a planner", hint="write KEY=VALUE")
        options[key] = value
    return options


def _print_planners(*, as_json: bool) -> None:
    from cxbridge_planning.registry import make_planner, planner_names

    planners = [(name, make_planner(name)) for name in planner_names()]
    if as_json:
        properties = [
            {
                "name": name,
                "installed": not planner.unavailable_reason,
                "understands": sorted(need.value for need in planner.understands),
            }
            for name, planner in planners
        ]
        say_json(properties, indent=2)
    else:
        for name, planner in planners:
            say(f"{name:14}  {planner.unavailable_reason or 'installed'}")


def _result_to_json(result: PlanResult) -> dict[str, object]:
    return {
        "status": result.status.value,
        "planner": result.planner,
        "seconds": round(result.seconds, 6),
        "message": result.message,
        "why": result.why,
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
