"""``cxbridge sweep``: plays thousands of runs in drawn worlds."""

from __future__ import annotations

import dataclasses
import os
import shlex
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import check_folders, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import ScenarioOptions, SourceOptions
from cxbridge_explore.cli.progress import progress

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cxbridge_explore.sweep.engine import Engine
    from cxbridge_explore.sweep.row_file import RowFile
    from cxbridge_explore.sweep.rows import RunRow, SweepJob
    from cxbridge_explore.sweep.summary import AgentComparison

_LOCAL = "local"
_DASK = "dask://"


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions):
    """Options that select the agent."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _SweepOptions:
    """Options of the runs and the engine."""

    runs: Annotated[int, typer.Option(min=1, help="How many runs.")] = 1000
    seed: Annotated[int, typer.Option(help="The seed of the first run; later runs count up from it.")] = 0
    against: Annotated[
        Path | None,
        typer.Option(metavar="SCENARIO", help="A second agent, in the same worlds.", show_default=False),
    ] = None
    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The world: outcomes of skills; by default world.yaml in the scenario's folder.",
            show_default=False,
        ),
    ] = None
    timeout: Annotated[float, typer.Option(min=0, help="Seconds of its clock that a run may take.")] = 600.0
    jobs: Annotated[
        int, typer.Option(min=0, help="Processes on this machine; 0: as many as it has processors.")
    ] = 0
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Keep the result of each run in this file, and skip the runs that it has already.",
            show_default=False,
        ),
    ] = None
    engine: Annotated[str, typer.Option(metavar="local|dask://HOST:PORT", help="Who plays the runs.")] = (
        _LOCAL
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class _SweepOutputs:
    """Options of the result."""

    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a row for each run.", show_default=False)
    ] = None
    parquet: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The same as Parquet.", show_default=False)
    ] = None
    page: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write a page with plots.", show_default=False),
    ] = None
    as_json: AsJson = False


@option_groups
def sweep(agent: _AgentOptions, play: _SweepOptions, outputs: _SweepOutputs) -> int:
    """Play a scenario many times, each in a world drawn by its seed: which skills fail, how long they take.

    One seed is one world: the same run every time. With --against, a second agent meets the same worlds.

    Exit status: 0 played; 1 no run of an agent came to its end; 2 bad input.

    Example: cxbridge sweep scenarios/courier --runs 10000 --html out/sweep.html
    """
    from cxbridge_explore.sweep.row_file import RowFile
    from cxbridge_explore.sweep.summary import AgentComparison, SweepSummary

    check_folders(outputs.csv, outputs.parquet, outputs.page)
    jobs = _jobs(agent, play)
    started = time.perf_counter()
    seeds = range(play.seed, play.seed + play.runs)
    with ExitStack() as stack:
        file = None if play.resume is None else stack.enter_context(RowFile(play.resume))
        engine = _engine(play, stack)
        sweeps = {name: _play(engine, name, job, seeds, file) for name, job in jobs.items()}
    wall_seconds = round(time.perf_counter() - started, 3)
    _write_files(sweeps, outputs)
    first, *others = sweeps.values()
    report: dict[str, Any] = {
        **SweepSummary(first).as_dict(),
        "seed": play.seed,
        "wall_seconds": wall_seconds,
    }
    comparison = None
    if others:
        (second,) = others
        report["against"] = SweepSummary(second).as_dict()
        comparison = AgentComparison({row.seed: row for row in first}, {row.seed: row for row in second})
        report["comparison"] = comparison.as_dict()
    if outputs.as_json:
        say_json(report)
    else:
        _print_outcomes(report)
        if comparison is not None:
            say(f"against {play.against}:")
            _print_outcomes(report["against"])
            _print_comparison(comparison)
    # The figures of an agent whose runs never end are meaningless, and a script must not use them.
    endless = [name for name, rows in sweeps.items() if not any(row.came_to_its_end for row in rows)]
    for name in endless:
        say(f"{name}: no run came to its end, so the sweep says nothing of the agent", err=True)
    return 1 if endless else 0


def _jobs(agent: _AgentOptions, play: _SweepOptions) -> dict[str, SweepJob]:
    """Return a job for each agent, by its name."""
    from cxbridge.run.options import RunOptions
    from cxbridge_explore.sweep.rows import SweepJob

    # Without Skillers: the world decides how skills end.
    options = RunOptions(**vars(agent), skiller="none", timeout=play.timeout)
    jobs = {str(agent.scenario or agent.spec or "agent"): SweepJob(options, play.world)}
    if play.against is not None:
        jobs[str(play.against)] = SweepJob(dataclasses.replace(options, scenario=play.against), play.world)
        if len(jobs) == 1:
            raise CxbridgeError(f"--against names the same agent: {play.against}", hint="name another one")
    for job in jobs.values():
        job.options.check()
    return jobs


def _engine(play: _SweepOptions, stack: ExitStack) -> Engine:
    """Return the engine that the options select; the stack closes it."""
    from cxbridge_explore.sweep.engine import LocalEngine

    if play.engine == _LOCAL:
        return LocalEngine(play.jobs or os.cpu_count() or 1)
    if play.engine.startswith(_DASK):
        from cxbridge_explore.sweep.dask_engine import DaskEngine

        return stack.enter_context(DaskEngine(play.engine.removeprefix(_DASK)))
    raise CxbridgeError(f"--engine cannot be '{play.engine}'", hint=f"use {_LOCAL} or {_DASK}HOST:PORT")


def _play(
    engine: Engine, name: str, job: SweepJob, seeds: Sequence[int], file: RowFile | None
) -> list[RunRow]:
    """Return the rows of an agent, in the order of seeds.

    :param file: provides earlier rows and keeps new ones; None to keep none.
    """
    earlier_rows = {} if file is None else file.rows_of(name)
    rows = {seed: earlier_rows[seed] for seed in seeds if seed in earlier_rows}
    missing = [seed for seed in seeds if seed not in rows]
    with progress(name, len(missing)) as advance:
        for row in engine.rows(job, missing) if missing else ():
            rows[row.seed] = row
            if file is not None:
                file.add(name, row)
            advance()
    return [rows[seed] for seed in seeds]


def _write_files(sweeps: Mapping[str, Sequence[RunRow]], outputs: _SweepOutputs) -> None:
    from cxbridge_explore.sweep.files import write_csv, write_page, write_parquet

    if outputs.csv is not None:
        write_csv(sweeps, outputs.csv)
    if outputs.parquet is not None:
        write_parquet(sweeps, outputs.parquet)
    if outputs.page is not None:
        write_page(sweeps, outputs.page, shlex.join(["cxbridge", *sys.argv[1:]]))


def _print_comparison(comparison: AgentComparison) -> None:
    """Print the differences between two agents."""
    completed, makespan = comparison.completed, comparison.makespan
    share, span = 100 * completed.estimate, completed.span("+.2f", scale=100)
    say(f"difference in completed runs: {share:+.2f} % ({span})")
    if makespan is not None:
        say(f"difference in makespan: {makespan.estimate:+.3f} s ({makespan.span('+.3f')})")
    for runs in comparison.as_dict()["seeds"]:
        first, second = runs["outcomes"]
        spans = " and ".join(f"{value:.2f} s" for value in runs["makespans"])
        say(f"  seed {runs['seed']}: {first} and {second}, {spans}")


def _print_outcomes(report: dict[str, Any]) -> None:
    for outcome, count in report["outcomes"].items():
        seeds = report["seeds"].get(outcome, ())
        first = f", first seeds {', '.join(map(str, seeds))}" if seeds else ""
        say(f"{outcome}: {count} of {report['runs']}{first}")
    if report["makespan"] is not None:
        spans = ", ".join(f"{name} {value:.2f}" for name, value in report["makespan"].items())
        say(f"makespan of completed runs, seconds: {spans}")
    for goal_class, outcomes in report["goals"].items():
        counts = ", ".join(f"{outcome} {count}" for outcome, count in outcomes.items())
        say(f"goal {goal_class}: {counts}")
