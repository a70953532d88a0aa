"""The command ``cxbridge explore``, which plays a scenario in every way that its world allows."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import complain, make_output_folders, progress_line, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions, ScenarioOptions, SourceOptions, StrictnessOptions
from cxbridge_explore.bounds import Bounds, ExecutionOptions
from cxbridge_explore.game.kinds import (
    EXPLORED_GAMES,
    ExploredGameOptions,
    find_chosen_game,
    load_game_options,
)

if TYPE_CHECKING:
    from cxbridge_explore.checkpoint import ProgramIdentity
    from cxbridge_explore.result import ExploreResult
    from cxbridge_explore.worldmodel.model import WorldModel
    from cxbridge_explore.worlds.run import MakeAssembly
    from cxbridge_studio.explain.coverage.model import Coverage

DEFAULT_CHECKPOINT: Final = "explore.resume"  # the file that an interrupted exploration writes


@dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions, StrictnessOptions):
    """Options that select the agent."""

    timeout: Annotated[
        float, typer.Option(help="The time limit of a run, in seconds of its clock.", show_default=True)
    ] = 600.0


@dataclass(frozen=True, kw_only=True)
class _ExploreOptions:
    """Options of the world, the properties and the outputs."""

    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Read the world, the possible outcomes and times, from this file; by default from the "
            "scenario's world.yaml.",
            show_default=False,
        ),
    ] = None
    properties: Annotated[
        tuple[str, ...],
        typer.Option(
            "--property",
            metavar="NAME|FORM",
            help="Watch this property, e.g. 'never (goal (outcome FAILED))'. Repeatable; by default the "
            "built-in properties and the properties of properties.yaml in the scenario's folder.",
        ),
    ] = ()
    out: Annotated[
        Path,
        typer.Option(metavar="FOLDER", help="The folder for the recording and the test of each violation."),
    ] = Path("out/explore")
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Print the rules, goals and actions that no run has reached.")
    ] = False
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write a page, updated during the exploration: a map of the runs, the effects of faults, "
            "and the parts of the agent that no run has reached. Its bars open pages of the runs, in a "
            "folder next to it.",
            show_default=False,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class _GameOptions:
    """Options with which plug-ins select a game in place of a scenario.

    :cvar added_groups: returns the groups of options of plug-ins, which become ``plugin_groups``.
    """

    added_groups: ClassVar[Callable[[], list[type[Any]]]] = partial(load_game_options, EXPLORED_GAMES)

    plugin_groups: tuple[ExploredGameOptions, ...] = ()


@option_groups
def explore(
    agent_options: _AgentOptions,
    bounds: Bounds,
    execution: ExecutionOptions,
    explore_options: _ExploreOptions,
    game_options: _GameOptions,
    *,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=f"Resume an interrupted exploration; Ctrl-C writes {DEFAULT_CHECKPOINT}.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Run a scenario in every way that its world allows, with at most K faults.

    Exit status: 0 no property is violated; 1 a property is violated; 2 bad input; 3 not complete.

    Example: cxbridge explore test-scenario --faults 2
    """
    from cxbridge_explore.explore import explore as explore_scenario
    from cxbridge_explore.properties.selection import select_properties
    from cxbridge_explore.worldmodel.reading import read_world
    from cxbridge_explore.worlds.run import make_scenario

    game = find_chosen_game(game_options.plugin_groups)
    make_output_folders(explore_options.html)
    # without a Skiller, since the world decides how skills end
    options = RunOptions(**vars(agent_options), skiller="none")
    make_assembly: MakeAssembly = make_scenario
    if game is not None:
        options, make_assembly = game.prepare_exploration(options)
    execution = replace(execution, coverage=explore_options.coverage or explore_options.html is not None)
    properties = select_properties(options, explore_options.properties, is_time_limited=game is not None)
    world = None if explore_options.world is None else read_world(explore_options.world)
    command = shlex.join(["cxbridge", *sys.argv[1:]])
    with progress_line() as show_line:
        result = explore_scenario(
            options,
            bounds,
            execution,
            properties=properties,
            world=world,
            make_assembly=make_assembly,
            resume=resume,
            show_line=show_line,
            draw_page=partial(_write_live_page, explore_options.html, command),
        )
    result = _write_counterexamples(result, options, world, make_assembly, explore_options.out)
    if not result.is_complete:
        from cxbridge_explore.checkpoint import make_identity

        identity = make_identity(options, bounds, properties, world, make_assembly)
        _write_checkpoint(result, identity, resume or Path(DEFAULT_CHECKPOINT))
    coverage = _compute_coverage(result, options) if execution.coverage else None
    if coverage is not None and explore_options.html is not None:
        _write_page(result, coverage, explore_options.html, command, (options, world, make_assembly))
    _print_result(result, coverage, as_json=as_json)
    return result.status


def _write_live_page(file: Path | None, command: str, result: ExploreResult) -> None:
    """Write the page of an exploration that is still running, if a page is requested."""
    from cxbridge_explore.map.page import write_page

    if file is not None:
        write_page(result, coverage=None, file=file, command=command, is_live=True)


def _write_page(
    result: ExploreResult,
    coverage: Coverage,
    file: Path,
    command: str,
    program: tuple[RunOptions, WorldModel | None, MakeAssembly],
) -> None:
    """Write the page of a complete or interrupted exploration, and the pages of runs and counterexamples.

    :param program: the options, the world and the maker of the explored runs, to play runs again.
    """
    from cxbridge_explore.map.page import write_page
    from cxbridge_explore.map.rows import make_run_rows
    from cxbridge_explore.map.run_pages import write_run_pages, write_violation_pages

    run_addresses = write_run_pages(result.graph, make_run_rows(result.graph), file, *program)
    stories = write_violation_pages(result.counterexamples, file)
    write_page(result, coverage, file, command, run_addresses=run_addresses, stories=stories)


def _compute_coverage(result: ExploreResult, options: RunOptions) -> Coverage:
    from cxbridge_explore.map.coverage import compute_explored_coverage

    return compute_explored_coverage(options, result.graph.used_parts)


def _print_result(result: ExploreResult, coverage: Coverage | None, *, as_json: bool) -> None:
    from cxbridge_explore.map.coverage import describe_unreached_parts, encode_coverage

    if as_json:
        say_json(
            result.as_dict() | ({} if coverage is None else {"coverage": encode_coverage(coverage)}), indent=2
        )
        return
    for line in (*result.lines(), *(() if coverage is None else describe_unreached_parts(coverage))):
        say(line)


def _write_counterexamples(
    result: ExploreResult,
    options: RunOptions,
    world: WorldModel | None,
    make_assembly: MakeAssembly,
    folder: Path,
) -> ExploreResult:
    """Write counterexamples, and return the result with the written counterexamples.

    A run that was given up gets none. A failure to write is a warning.
    """
    from cxbridge_explore.counterexample import write_counterexample
    from cxbridge_explore.worlds.points import read_path

    counterexamples = {}
    for violation in result.violations:
        if violation.get("is_given_up"):
            continue  # a run on the same path would not end either
        name = violation["property"]
        # printed first, since shortening plays more runs, which take seconds if rules fire endlessly
        say(f"{name} is violated: {violation['message']}; its counterexample follows", err=True, flush=True)
        try:
            path = read_path(violation["choices"])
            counterexamples[name] = write_counterexample(
                options, result.properties, name, path, folder, world, make_assembly
            )
        except CxbridgeError as error:
            complain(f"{name}: no counterexample was written: {error}")
    return replace(result, counterexamples=counterexamples)


def _write_checkpoint(result: ExploreResult, identity: ProgramIdentity, file: Path) -> None:
    """Write the checkpoint; a failure is a warning, since the result is still of use."""
    from cxbridge_explore.checkpoint import write_checkpoint

    try:
        write_checkpoint(file, result.graph, identity)
    except CxbridgeError as error:
        complain(f"no checkpoint was written: {error}")
    else:
        say(f"cxbridge: interrupted; continue with --resume {file}", err=True)
