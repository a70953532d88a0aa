"""`cxbridge run`: run a scenario headless, to its end."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from cxbridge.cli.console import say, say_json
from cxbridge.cli.console_options import ConsoleOptions
from cxbridge.cli.option_groups import Before, option_groups
from cxbridge.cli.orderly import orderly
from cxbridge.run.options import RunOptions


@option_groups
@orderly()
def run(
    options: RunOptions,
    console: ConsoleOptions,
    breaks: Annotated[
        list[str] | None,
        typer.Option(
            "--break",
            metavar="SPEC",
            help="Stop there and take commands from stdin, e.g. rule:NAME, goal:CLASS:MODE. Repeatable.",
        ),
        Before("strict"),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON."), Before("quiet")
    ] = False,
) -> int:
    """Run a scenario headless, to its end.

    Exit status: 0 every root goal ended COMPLETED; 1 some ended FAILED or REJECTED; 2 bad input;
    3 the timeout passed; 4 a fault of the run itself; 130 interrupted. With --replay: 0 it decided the same;
    1 something else. See docs/replay.md. With --break: docs/debugging.md.
    """
    from cxbridge.run import run_scenario

    attach = None
    if breaks:
        from cxbridge.cli.command_lines import CommandLines
        from cxbridge.cli.debug_prompt import DebugPrompt

        attach = DebugPrompt(breaks, CommandLines(), sys.stderr if as_json else sys.stdout).attach
    result = run_scenario(options, console.log(), attach)
    if as_json:
        say_json(result.as_dict(), indent=2)
    else:
        for line in result.summary_lines():
            say(line)
    return result.status
