"""The command ``cxbridge sweep``, which plays thousands of runs in random worlds."""

from __future__ import annotations

import dataclasses
import os
import time
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import make_output_folders, progress_line, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import ScenarioOptions, SourceOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge_explore.sweep.row_file import RowFile
    from cxbridge_explore.sweep.rows import RunRow, SweepJob
    from cxbridge_explore.sweep.summary import AgentComparison


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions):
    """Options that select the agent."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _SweepOptions:
    """Options of the runs."""

    runs: Annotated[int, typer.Option(min=1, help="The number of runs.")] = 1000
    seed: Annotated[
        int, typer.Option(help="The seed of the first run; each later run has the next number.")
    ] = 0
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENARIO", help="A second agent, which plays in the same worlds.", show_default=False
        ),
    ] = None
    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the outcomes of skills from the world in this file; by default from the scenario's "
            "world.yaml.",
            show_default=False,
        ),
    ] = None
    timeout: Annotated[
        float, typer.Option(min=0, help="The time limit of a run, in seconds of its clock.")
    ] = 600.0
    jobs: Annotated[
        int, typer.Option(min=0, help="The number of processes on this machine; 0: one per processor.")
    ] = 0
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Store the result of each run in this file, and skip the runs that the file already has.",
            show_default=False,
        ),
    ] = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class _SweepOutputs:
    """Options of the result."""

    csv: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a CSV file with a row for each run.", show_default=False),
    ] = None
    as_json: AsJson = False


@option_groups
def sweep(agent_options: _AgentOptions, sweep_options: _SweepOptions, outputs: _SweepOutputs) -> int:
    """Play a scenario many times, each time in a random world: which skills fail, how long they take.

    The seed determines the world, so a run can be repeated. With --against, a second agent plays in the same
    worlds.

    Exit status: 0 played; 1 no run of an agent reached its end; 2 bad input.

    Example: cxbridge sweep scenarios/courier --runs 10000 --csv out/sweep.csv
    """
    from cxbridge_explore.sweep.csv_file import write_csv
    from cxbridge_explore.sweep.row_file import RowFile
    from cxbridge_explore.sweep.summary import AgentComparison, summarize_rows

    make_output_folders(outputs.csv)
    jobs = _make_jobs(agent_options, sweep_options)
    start_s = time.perf_counter()
    seeds = range(sweep_options.seed, sweep_options.seed + sweep_options.runs)
    with nullcontext() if sweep_options.resume is None else RowFile(sweep_options.resume) as row_file:
        rows_by_agent = {
            name: _play_sweep(sweep_options, name, job, seeds, row_file) for name, job in jobs.items()
        }
    wall_seconds = round(time.perf_counter() - start_s, 3)
    if outputs.csv is not None:
        write_csv(rows_by_agent, outputs.csv)
    first_rows, *further_rows = rows_by_agent.values()
    report: dict[str, Any] = {
        **summarize_rows(first_rows),
        "seed": sweep_options.seed,
        "wall_seconds": wall_seconds,
    }
    comparison = None
    if further_rows:
        (second_rows,) = further_rows
        report["against"] = summarize_rows(second_rows)
        comparison = AgentComparison(
            {row.seed: row for row in first_rows}, {row.seed: row for row in second_rows}
        )
        report["comparison"] = comparison.as_dict()
    if outputs.as_json:
        say_json(report)
    else:
        _print_outcomes(report)
        if comparison is not None:
            say(f"against {sweep_options.against}:")
            _print_outcomes(report["against"])
            _print_comparison(comparison)
    # The command fails, since the figures of an agent whose runs never end are meaningless.
    endless_agents = [name for name, rows in rows_by_agent.items() if not any(row.has_ended for row in rows)]
    for name in endless_agents:
        say(f"{name}: no run reached its end, so the sweep says nothing about the agent", err=True)
    return 1 if endless_agents else 0


def _make_jobs(agent_options: _AgentOptions, sweep_options: _SweepOptions) -> dict[str, SweepJob]:
    """Return the job of each agent, by the name of the agent."""
    from cxbridge.run.options import RunOptions
    from cxbridge_explore.sweep.rows import SweepJob

    # without a Skiller, since the world decides how skills end
    options = RunOptions(**vars(agent_options), skiller="none", timeout=sweep_options.timeout)
    jobs = {
        str(agent_options.scenario or agent_options.spec or "agent"): SweepJob(options, sweep_options.world)
    }
    if sweep_options.against is not None:
        jobs[str(sweep_options.against)] = SweepJob(
            dataclasses.replace(options, scenario=sweep_options.against), sweep_options.world
        )
        if len(jobs) == 1:
            raise CxbridgeError(
                f"--against names the same agent: {sweep_options.against}", hint="name another agent"
            )
    for job in jobs.values():
        job.options.check()
    return jobs


def _play_sweep(
    sweep_options: _SweepOptions, agent: str, job: SweepJob, seeds: Sequence[int], row_file: RowFile | None
) -> list[RunRow]:
    """Play the runs of an agent, and return their rows in the order of seeds.

    :param agent: the name of the agent, for progress and the file.
    :param row_file: has the rows of earlier runs, and stores new rows; None to store no rows.
    """
    from cxbridge_explore.sweep.engine import play_seeds

    earlier_rows = {} if row_file is None else row_file.find_earlier_rows(agent)
    rows = {seed: earlier_rows[seed] for seed in seeds if seed in earlier_rows}
    missing_seeds = [seed for seed in seeds if seed not in rows]
    with progress_line() as show_line:
        for row in play_seeds(job, missing_seeds, sweep_options.jobs or os.cpu_count() or 1):
            rows[row.seed] = row
            if row_file is not None:
                row_file.add(agent, row)
            show_line(f"{agent}: {len(rows)} of {len(seeds)} runs")
    return [rows[seed] for seed in seeds]


def _print_comparison(comparison: AgentComparison) -> None:
    """Print the differences between two agents."""
    completion, makespan = comparison.completion_difference, comparison.makespan_difference
    percent, bounds_text = 100 * completion.estimate, completion.format_bounds("+.2f", scale=100)
    say(f"difference in completed runs: {percent:+.2f} % ({bounds_text})")
    if makespan is not None:
        say(f"difference in makespan: {makespan.estimate:+.3f} s ({makespan.format_bounds('+.3f')})")
    for run_pair in comparison.as_dict()["seeds"]:
        first_outcome, second_outcome = run_pair["outcomes"]
        makespans = " and ".join(f"{seconds:.2f} s" for seconds in run_pair["makespans"])
        say(f"  seed {run_pair['seed']}: {first_outcome} and {second_outcome}, {makespans}")


def _print_outcomes(report: dict[str, Any]) -> None:
    for outcome, count in report["outcomes"].items():
        seeds = report["seeds"].get(outcome, ())
        first_seeds = f", first seeds {', '.join(map(str, seeds))}" if seeds else ""
        say(f"{outcome}: {count} of {report['runs']}{first_seeds}")
    if report["makespan"] is not None:
        statistics = ", ".join(f"{name} {seconds:.2f}" for name, seconds in report["makespan"].items())
        say(f"makespan of completed runs, seconds: {statistics}")
    for goal_class, outcomes in report["goals"].items():
        counts = ", ".join(f"{outcome} {count}" for outcome, count in outcomes.items())
        say(f"goal {goal_class}: {counts}")
