"""`cxbridge coverage`: what a set of recorded runs has used of an agent."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import say, say_json
from cxbridge.errors import CxbridgeError, TraceError

if TYPE_CHECKING:
    from cxbridge.explain.coverage.model import AgentSources, Coverage
    from cxbridge.run import RunOptions
    from cxbridge.trace.formats.base import Run

_EXECUTIVE = "executive"


def coverage(  # noqa: C901, PLR0913, PLR0917  a command has as many options as it has
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Recordings, of level rules at least.")
    ],
    scenario: Annotated[
        Path | None,
        typer.Option(help="Whose files count; by default those in the recordings.", show_default=False),
    ] = None,
    spec: Annotated[
        str | None, typer.Option(help="The spec; the configuration's by default.", show_default=False)
    ] = None,
    fawkes_dir: Annotated[
        Path | None, typer.Option(help="A Fawkes checkout, as for run.", show_default=False)
    ] = None,
    files: Annotated[
        list[str] | None,
        typer.Option(metavar="GLOB", help="Only rules of files whose path or name matches. Repeatable."),
    ] = None,
    core: Annotated[bool, typer.Option("--core", help="Count the rules of the built-in core, too.")] = False,
    env: Annotated[str, typer.Option(metavar="NAME", help="The CLIPS environment.")] = _EXECUTIVE,
    lcov: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a tracefile of lcov.", show_default=False)
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--html", metavar="FILE", help="Write a page with the sources of the rules.", show_default=False
        ),
    ] = None,
    fail_under: Annotated[
        float | None,
        typer.Option(
            metavar="PERCENT", help="Exit status 1 when less of the rules fired.", show_default=False
        ),
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Tell which rules, goal classes and modes, actions and skills a set of recorded runs has used.

    Exit status: 0 reported; 1 less than --fail-under; 2 a run cannot be read, or lacks what is asked for.
    """
    from cxbridge.explain.coverage import report as coverage_report
    from cxbridge.explain.coverage.model import AgentSources, RecordedUse, add_recorded_agent, coverage_of
    from cxbridge.run import RunOptions
    from cxbridge.trace.formats.registry import open_run

    if fail_under is not None and not 0 <= fail_under <= 100:  # noqa: PLR2004  per cent
        raise CxbridgeError(f"--fail-under cannot be {fail_under:g}", hint="use a number from 0 to 100")
    opened = [open_run(path) for path in runs]
    agent, use = AgentSources(), RecordedUse()
    named = scenario is not None or fawkes_dir is not None
    if named:
        _add_scenario(agent, RunOptions(scenario=scenario, spec=spec, fawkes_dir=fawkes_dir), core=core)
    for run in opened:
        if not named and not add_recorded_agent(agent, run, env, core=core):
            _refuse(run)
        use.add(run, env)
    firings_known = len(use.without_firings) < len(opened)
    if not firings_known and (lcov is not None or fail_under is not None):
        raise TraceError(
            "no firings are recorded", file=opened[0].path, hint="record with --trace-level rules or facts"
        )
    found = coverage_of(agent, use, tuple(files or ()))
    if files and not found.files:
        raise CxbridgeError(
            f"no rule is in a file like {', '.join(files)}", hint="see the files without --files"
        )
    if lcov is not None:
        lcov.write_text(
            "".join(f"{line}\n" for line in coverage_report.lcov(found)),
            encoding="utf-8",
            errors="surrogateescape",
        )
    if page is not None:
        _write_page(page, runs, found, agent, firings_known=firings_known)
    if as_json:
        say_json(coverage_report.plain(found), indent=2)
    else:
        for line in coverage_report.lines(found, firings_known=firings_known):
            say(line)
    return 1 if fail_under is not None and found.percent < fail_under else 0


def _write_page(
    page: Path, runs: list[Path], found: Coverage, agent: AgentSources, *, firings_known: bool
) -> None:
    """Write the page, unless it would replace one of the recordings."""
    from cxbridge.explain.coverage.page import write_page

    if page.exists() and any(page.samefile(run) for run in runs):
        raise typer.BadParameter("the page would replace a recording", param_hint="--html")
    write_page(page, found, agent.texts, firings_known=firings_known)


def _add_scenario(agent: AgentSources, options: RunOptions, *, core: bool) -> None:
    """Add the files that a scenario loads."""
    from cxbridge.run.evidence import scenario_sources

    for source in scenario_sources(options):
        agent.add_source(source, core=core)


def _refuse(run: Run) -> None:
    raise TraceError(
        "this recording has no CLIPS files with it, so it is not known what there is to cover",
        file=run.path,
        hint="name the scenario that was run (--scenario), or the Fawkes whose log it is (--fawkes-dir)",
    )
