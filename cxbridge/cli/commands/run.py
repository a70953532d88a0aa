"""`cxbridge run`: run a scenario headless, to its end."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.console import say_json
from cxbridge.cli.console_options import ConsoleOptions
from cxbridge.cli.option_groups import Before, option_groups
from cxbridge.cli.orderly import in_words_of_check, orderly
from cxbridge.cli.staying import stay_after
from cxbridge.run.options import RunOptions

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult


@dataclass(frozen=True, kw_only=True)
class _Console(ConsoleOptions):
    """The output of a run."""

    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the result and errors only.")] = False
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print the log, too: all that rules and skills print.")
    ] = False


@option_groups
@orderly()
def run(
    options: RunOptions,
    console: _Console,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON."), Before("quiet")
    ] = False,
) -> int:
    """Run a scenario to its end; with --web, watch it in the browser.

    Exit status: 0 every root goal ended COMPLETED or maintains; 1 some ended FAILED or REJECTED; 2 bad input;
    3 the timeout passed; 4 a fault of the run itself; 130 interrupted. With --replay: 0 it decided the same;
    1 something else. See docs/recording.md. With --break: docs/debugging.md.

    Example: cxbridge run test-scenario --trace out/run.mcap
    """
    from cxbridge.cli.story import RunLog, RunStory
    from cxbridge.run.run import run_scenario

    shown, story = RunLog(quiet=console.quiet, verbose=console.verbose), None
    followers = [shown.attach]
    if not as_json:
        story = RunStory(quiet=console.quiet)
        followers.append(story.attach)

    def attach(assembly: Run) -> None:
        for follow in followers:
            follow(assembly)

    stdout = sys.stdout
    results: list[RunResult] = []

    def show(result: RunResult) -> None:
        if results:
            return
        results.append(result)
        shown.finish()
        if story is None:
            with redirect_stdout(stdout):
                say_json(result.as_dict(), indent=2)
        else:
            story.finish(result)

    # with --json, stdout is only for the result, not for the output of a prompt
    with in_words_of_check(options), redirect_stdout(sys.stderr if as_json else stdout):
        result = run_scenario(options, shown, attach, stay=stay_after(show))
    show(result)
    return result.status
