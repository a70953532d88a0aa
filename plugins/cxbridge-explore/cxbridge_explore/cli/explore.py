"""``cxbridge explore``: plays a scenario in every way that its world allows."""

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
from cxbridge.cli.console import check_folders, complain, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.printing import one_line, unfiltered_stream
from cxbridge.run.options import BrokenOptions, RunOptions, ScenarioOptions, SourceOptions
from cxbridge_explore.bounds import Bounds, ExecutionOptions
from cxbridge_explore.game.kinds import EXPLORED_GAMES, ExploredGame, chosen_game

if TYPE_CHECKING:
    from cxbridge_explore.checkpoint import ProgramIdentity
    from cxbridge_explore.result import ExploreResult
    from cxbridge_explore.worldmodel.model import WorldModel
    from cxbridge_explore.worlds.run import MakeAssembly
    from cxbridge_studio.explain.coverage.model import Coverage

RESUME: Final = "explore.resume"  # default checkpoint file of an interrupted exploration


@dataclass(frozen=True, kw_only=True)
class _Agent(ScenarioOptions, SourceOptions, BrokenOptions):
    """Options that select the agent."""

    timeout: Annotated[
        float, typer.Option(help="The time limit of a run, in seconds of its clock.", show_default=True)
    ] = 600.0


@dataclass(frozen=True, kw_only=True)
class _Judging:
    """Options of the world, the properties and the outputs."""

    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The world: the possible outcomes and times; by default the scenario's world.yaml.",
            show_default=False,
        ),
    ] = None
    properties: Annotated[
        tuple[str, ...],
        typer.Option(
            "--property",
            metavar="NAME|FORM",
            help="Watch this property, e.g. 'never (goal (mode FAILED))'. Repeatable; by default the "
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


def _game_options() -> list[type[Any]]:
    return [EXPLORED_GAMES.load(row) for row in EXPLORED_GAMES.rows]


@dataclass(frozen=True, kw_only=True)
class _Games:
    """Options of plug-ins for a game instead of a scenario."""

    added_groups: ClassVar[Callable[[], list[type[Any]]]] = _game_options

    more: tuple[ExploredGame, ...] = ()


@option_groups
def explore(
    agent: _Agent,
    bounds: Bounds,
    execution: ExecutionOptions,
    judging: _Judging,
    games: _Games,
    *,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=f"Resume an interrupted exploration; Ctrl-C writes {RESUME}.",
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
    from cxbridge_explore.judging import properties_of
    from cxbridge_explore.worldmodel.reading import read_world
    from cxbridge_explore.worlds.run import make_scenario

    game = chosen_game(games.more)
    check_folders(judging.html)
    options = RunOptions(**vars(agent), skiller="none")
    make: MakeAssembly = make_scenario
    if game is not None:
        options, make = game.explored(options)
    execution = replace(execution, coverage=judging.coverage or judging.html is not None)
    show = _show_line if sys.stderr.isatty() else None
    properties = properties_of(options, judging.properties, is_cut=game is not None)
    world = None if judging.world is None else read_world(judging.world)
    command = shlex.join(["cxbridge", *sys.argv[1:]])
    result = explore_scenario(
        options,
        bounds,
        execution,
        properties=properties,
        world=world,
        make=make,
        resume=resume,
        show=show,
        draw=None if judging.html is None else partial(_draw, judging.html, command),
    )
    if show is not None:
        _show_line("")
    result = _with_counterexamples(result, options, world, make, judging.out)
    if not result.is_complete:
        from cxbridge_explore.checkpoint import identity_of

        identity = identity_of(options, bounds, properties, world, make)
        _write_checkpoint(result, identity, resume or Path(RESUME))
    coverage = _coverage(result, options) if execution.coverage else None
    if coverage is not None and judging.html is not None:
        _write_page(result, coverage, judging.html, command, (options, world, make))
    _print_result(result, coverage, as_json=as_json)
    return result.status


def _draw(file: Path, command: str, result: ExploreResult) -> None:
    """Write the page of an exploration that is still running."""
    from cxbridge_explore.map.page import write_page

    write_page(result, None, file, command, is_live=True)


def _write_page(
    result: ExploreResult,
    coverage: Coverage,
    file: Path,
    command: str,
    program: tuple[RunOptions, WorldModel | None, MakeAssembly],
) -> None:
    """Write the page, with the pages of runs and counterexamples."""
    from cxbridge_explore.map.page import write_page
    from cxbridge_explore.map.rows import run_rows
    from cxbridge_explore.map.run_pages import violation_stories, write_run_pages

    pages = write_run_pages(result.graph, run_rows(result.graph), file, *program)
    stories = violation_stories(result.counterexamples, file)
    write_page(result, coverage, file, command, pages=pages, stories=stories)


def _coverage(result: ExploreResult, options: RunOptions) -> Coverage:
    from cxbridge_explore.map.coverage import explored_coverage

    return explored_coverage(options, result.graph.used)


def _print_result(result: ExploreResult, coverage: Coverage | None, *, as_json: bool) -> None:
    from cxbridge_explore.map.coverage import as_dict, never_reached

    if as_json:
        say_json(result.as_dict() | ({} if coverage is None else {"coverage": as_dict(coverage)}), indent=2)
        return
    for line in (*result.lines(), *(() if coverage is None else never_reached(coverage))):
        say(line)


def _with_counterexamples(
    result: ExploreResult, options: RunOptions, world: WorldModel | None, make: MakeAssembly, folder: Path
) -> ExploreResult:
    """Write the counterexample of each violation, and return the result with the counterexamples."""
    from cxbridge_explore.counterexample import write_counterexample
    from cxbridge_explore.worlds.points import read_path

    counterexamples = {}
    for violation in result.violations:
        if violation.get("is_given_up"):
            continue  # the run would not end this time either
        name = violation["property"]
        # A counterexample plays more runs, which take seconds if rules fire endlessly.
        say(f"{name} is violated: {violation['message']}; its counterexample follows", err=True, flush=True)
        try:
            path = read_path(violation["choices"])
            counterexamples[name] = write_counterexample(
                options, result.properties, name, path, folder, world, make
            )
        except CxbridgeError as error:
            complain(f"{name}: there is no counterexample: {error}")
    return replace(result, counterexamples=counterexamples)


def _show_line(text: str) -> None:
    """Overwrite the line of progress."""
    unfiltered_stream(sys.stderr).write(f"\r{one_line(text)}\x1b[K")
    sys.stderr.flush()


def _write_checkpoint(result: ExploreResult, identity: ProgramIdentity, file: Path) -> None:
    """Write the checkpoint; a failure is only a warning."""
    from cxbridge_explore.checkpoint import write_checkpoint

    try:
        write_checkpoint(file, result.graph, identity)
    except OSError as error:
        complain(f"{file}: the checkpoint cannot be written: {error.strerror}")
    else:
        say(f"cxbridge: interrupted; continue with --resume {file}", err=True)
