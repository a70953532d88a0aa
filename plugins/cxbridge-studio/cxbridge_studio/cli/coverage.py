"""``cxbridge coverage``: measures how much of an agent a set of recorded runs used."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.file_access import write_file
from cxbridge.run.options import RunOptions

if TYPE_CHECKING:
    from cxbridge_studio.explain.coverage.model import AgentSources, Coverage, RecordedUse

_EXECUTIVE = "executive"  # the name of the executive's CLIPS environment


@dataclass(frozen=True, kw_only=True)
class _ScenarioOptions:
    """The options that select the scenario whose files are counted."""

    scenario: Annotated[
        Path | None,
        typer.Option(
            help="Count the files of this scenario; by default, the files that the recordings contain.",
            show_default=False,
        ),
    ] = None
    spec: Annotated[
        str | None,
        typer.Option(
            help="The spec to load; by default the spec that the configuration names.", show_default=False
        ),
    ] = None
    fawkes_dir: Annotated[
        Path | None,
        typer.Option(
            help="A Fawkes checkout: count its files, or the files of --scenario in it.", show_default=False
        ),
    ] = None

    @property
    def is_named(self) -> bool:
        return self.scenario is not None or self.fawkes_dir is not None


@dataclass(frozen=True, kw_only=True)
class _CoverageOutputs:
    """The options for the output files and the required percentage."""

    lcov: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write an lcov tracefile.", show_default=False)
    ] = None
    fail_under: Annotated[
        float | None,
        typer.Option(
            metavar="PERCENT",
            help="Exit with status 1 if less than PERCENT of the rules fired.",
            show_default=False,
        ),
    ] = None
    as_json: AsJson = False


@option_groups
def coverage(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Recordings with at least the trace level rules.")
    ],
    scenario: _ScenarioOptions,
    files: Annotated[
        list[str] | None,
        typer.Option(metavar="GLOB", help="Count only files with a path or name that matches. Repeatable."),
    ] = None,
    core: Annotated[bool, typer.Option("--core", help="Count the rules of the built-in core, too.")] = False,
    env: Annotated[
        str, typer.Option(metavar="NAME", help="Count the rules that fired in this CLIPS environment.")
    ] = _EXECUTIVE,
    *,
    outputs: _CoverageOutputs,
) -> int:
    """Show which rules, goal classes and modes, actions and skills a set of recorded runs used.

    Exit status: 0 reported; 1 less than --fail-under; 2 a run cannot be read, or lacks the needed events.

    Example: cxbridge coverage out/a.mcap out/b.mcap --lcov out/coverage.info
    """
    from cxbridge_studio.explain.coverage.model import compute_coverage

    fail_under = outputs.fail_under
    if fail_under is not None and not 0 <= fail_under <= 100:  # noqa: PLR2004 - per cent
        raise CxbridgeError(f"--fail-under cannot be {fail_under:g}", hint="use a number from 0 to 100")
    agent, recorded_use = _read_runs(runs, scenario, env, core=core)
    has_firings = len(recorded_use.runs_without_firings) < len(runs)
    if not has_firings and (outputs.lcov is not None or fail_under is not None):
        raise TraceError(
            "no firings are recorded", file=runs[0], hint="record with --trace-level rules or facts"
        )
    result = compute_coverage(agent, recorded_use, tuple(files or ()))
    if files and not result.files:
        raise CxbridgeError(
            f"no file with rules matches {', '.join(files)}", hint="omit --files to see all files"
        )
    _write_outputs(outputs, result, has_firings=has_firings)
    return 1 if fail_under is not None and result.percent < fail_under else 0


def _read_runs(
    paths: list[Path], scenario: _ScenarioOptions, env: str, *, core: bool
) -> tuple[AgentSources, RecordedUse]:
    """Return the agent's sources, from the scenario or the recordings, and their recorded use."""
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_studio.check.sources import read_scenario_sources
    from cxbridge_studio.explain.coverage.model import AgentSources, RecordedUse, add_recorded_agent

    # open all recordings first: a file of another format is an error before the slow part
    runs = [open_run(path) for path in paths]
    agent, recorded_use = AgentSources(), RecordedUse()
    if scenario.spec is not None and not scenario.is_named:
        raise CxbridgeError("--spec needs a scenario", hint="name it with --scenario")
    for source in read_scenario_sources(RunOptions(**vars(scenario))) if scenario.is_named else ():
        agent.add_source(source, include_core=core)
    for run in runs:
        recorded_use.add(run, env)
        if not scenario.is_named and not add_recorded_agent(agent, run, env, include_core=core):
            raise TraceError(
                "this recording contains no CLIPS files, so its rules are unknown",
                file=run.path,
                hint="name the scenario that was run (--scenario), "
                "or the Fawkes checkout that wrote the log (--fawkes-dir)",
            )
    return agent, recorded_use


def _write_outputs(outputs: _CoverageOutputs, result: Coverage, *, has_firings: bool) -> None:
    """Write the requested files, and print the result as text or JSON."""
    from cxbridge_studio.explain.coverage import report

    if outputs.lcov is not None:
        text = "".join(f"{line}\n" for line in report.format_lcov_lines(result))
        write_file(outputs.lcov, text.encode("utf-8", "surrogateescape"))
    if outputs.as_json:
        say_json(report.to_json(result), indent=2)
    else:
        for line in report.format_report(result, has_firings=has_firings):
            say(line)
