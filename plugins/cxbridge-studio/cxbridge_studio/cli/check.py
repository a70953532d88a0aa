"""``cxbridge check``: reports the mistakes in an agent without running the agent."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say_text
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import ScenarioOptions, SourceOptions
from cxbridge.run.source import source_of

_TEXT = "text"


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions):
    """Options that select the agent to check."""

    skiller: Annotated[
        str,
        typer.Option(
            metavar="lua|simulator|none|URL",
            help="The Skiller that executes skills; with lua, skills are checked, too.",
        ),
    ] = "lua"


@option_groups
def check(
    options: _AgentOptions,
    format_name: Annotated[
        str, typer.Option("--format", metavar="text|json|github", help="Output format of the findings.")
    ] = _TEXT,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, as --format json does.")] = False,
    portable: Annotated[
        bool, typer.Option("--portable", help="Also report code that Fawkes does not accept.")
    ] = False,
    explain: Annotated[
        str, typer.Option(metavar="CODE", help="Explain a code, e.g. CX201, and exit.", show_default=False)
    ] = "",
) -> int:
    """Check an agent without running it.

    Reads the configuration, CLIPS files, PDDL domain, action mapping and skills as a run does, and reports
    each mistake once, at its position. A comment silences a finding: ; cx-check: ignore CODE REASON.

    Exit status: 0 no errors; 1 errors; 2 bad usage.

    Example: cxbridge check scenarios/courier --format github
    """
    from cxbridge.run.options import RunOptions
    from cxbridge_studio.check.findings import Severity, shorten_path
    from cxbridge_studio.check.formats import FORMATS
    from cxbridge_studio.check.run import check as find_mistakes
    from cxbridge_studio.check.table import load_codes

    if explain:
        all_codes = load_codes()
        if explain not in all_codes:
            raise CxbridgeError(f"there is no code '{explain}'", hint=f"there are: {', '.join(all_codes)}")
        code = all_codes[explain]
        say_text(f"{code.name} ({code.severity.value}): {code.title}\n\n{code.explanation}")
        return 0
    format_name = "json" if as_json else format_name
    if format_name not in FORMATS:
        raise CxbridgeError(f"--format cannot be '{format_name}'", hint=f"use one of: {', '.join(FORMATS)}")
    run_options = RunOptions(**vars(options))
    if not source_of(run_options).is_named:  # then the scenario in the working directory is meant
        run_options = dataclasses.replace(run_options, scenario=Path())
    findings = [shorten_path(finding) for finding in find_mistakes(run_options, portable=portable)]
    if text := FORMATS[format_name](findings):
        say_text(text)
    return int(any(finding.code.severity is Severity.ERROR for finding in findings))
