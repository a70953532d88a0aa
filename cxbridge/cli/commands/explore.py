"""`cxbridge explore`: every way that a run can go."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import complain, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.printing import one_line, terminal_of
from cxbridge.run.options import BrokenOptions, RunOptions, ScenarioOptions, SourceOptions

if TYPE_CHECKING:
    from cxbridge.explore.bounds import Bounds
    from cxbridge.explore.result import ExploreResult

RESUME: Final = "explore.resume"
"""Where an exploration goes that was interrupted."""


@dataclass(frozen=True, kw_only=True)
class _Agent(ScenarioOptions, SourceOptions, BrokenOptions):
    """The agent that is explored."""

    timeout: Annotated[
        float, typer.Option(help="Seconds of a run's clock until it is given up.", show_default=True)
    ] = 600.0


@dataclass(frozen=True, kw_only=True)
class _Bounds:
    """How far to go."""

    faults: Annotated[int, typer.Option(metavar="K", help="How many faults a run may meet.")] = 1
    depth: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Only at the first N choice points the world does other than usual; all by default.",
            show_default=False,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class _Means:
    """How to go about it."""

    jobs: Annotated[
        int | None,
        typer.Option(metavar="N", help="Runs at the same time; one a core by default.", show_default=False),
    ] = None
    fork: Annotated[
        bool | None,
        typer.Option(
            "--fork/--no-fork",
            help="Fork a run at its choices, or begin each run at the beginning; fork where the system can.",
            show_default=False,
        ),
    ] = None
    patience_s: Annotated[
        float,
        typer.Option(
            "--patience",
            metavar="S",
            help="Seconds of processor time that a run may take from one choice to the next.",
        ),
    ] = 60.0


@option_groups
def explore(
    agent: _Agent,
    bounds: _Bounds,
    means: _Means,
    *,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=f"Go on with an exploration that was interrupted; Ctrl-C writes {RESUME}.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Run a scenario in every way that its world can go, with at most K faults.

    Exit status: 0 no property is violated; 1 some are; 2 bad input; 3 not complete.

    Example: cxbridge explore test-scenario --faults 2
    """
    from cxbridge.explore.bounds import Bounds, Means
    from cxbridge.explore.explore import explore as explore_scenario

    options = RunOptions(**vars(agent), skiller="none")
    limits = Bounds(**vars(bounds))
    how = Means(**{name: value for name, value in vars(means).items() if value is not None})
    show = _show_line if sys.stderr.isatty() else None
    result = explore_scenario(options, limits, how, resume=resume, show=show)
    if show is not None:
        _show_line("")
    if not result.is_complete:
        _keep(result, options, limits, resume or Path(RESUME))
    if as_json:
        say_json(result.as_dict(), indent=2)
    else:
        for line in result.lines():
            say(line)
    return result.status


def _show_line(text: str) -> None:
    """Show how far it is, in place of what was shown before."""
    terminal_of(sys.stderr).write(f"\r{one_line(text)}\x1b[K")
    sys.stderr.flush()


def _keep(result: ExploreResult, options: RunOptions, bounds: Bounds, file: Path) -> None:
    """Write what was explored, so that it can go on; that it cannot be written costs nothing else."""
    from cxbridge.explore.checkpoint import write_checkpoint

    try:
        write_checkpoint(file, result.graph, options, bounds)
    except OSError as error:
        complain(f"{file}: the exploration cannot be kept: {error.strerror}")
    else:
        say(f"cxbridge: interrupted; go on with --resume {file}", err=True)
