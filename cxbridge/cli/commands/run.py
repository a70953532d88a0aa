"""`cxbridge run`: run a scenario headless, to its end."""

from __future__ import annotations

import select
import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.console import say, say_json, say_text
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups
from cxbridge.run.options import RunOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult
    from cxbridge.run.servers import RunServer


@dataclass(frozen=True, kw_only=True)
class _OutputOptions:
    """The options for the output of a run."""

    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print the result and errors only.")] = False
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Also print the log, with all output of rules and skills.")
    ] = False


@option_groups
@handle_signals()
def run(options: RunOptions, output: _OutputOptions) -> int:
    """Run a scenario to its end; with --web, watch it in the browser.

    Exit status: 0 every root goal is COMPLETED or maintained; 1 a root goal is FAILED or REJECTED; 2 bad
    input; 3 the time limit was exceeded; 4 a fault of the run itself; 130 interrupted. With --replay: 0 the
    decisions are the recorded ones; 1 they differ. See docs/recording.md, and for --break docs/debugging.md.

    Example: cxbridge run test-scenario --trace out/run.mcap
    """
    from cxbridge.cli.run_output import RunLogPrinter, RunPrinter
    from cxbridge.run.explainers import explaining_mistakes, mistakes
    from cxbridge.run.result import TIMED_OUT, UNSUCCESSFUL
    from cxbridge.run.run import run_scenario

    log = RunLogPrinter(quiet=output.quiet, verbose=output.verbose)
    printer = None if output.as_json else RunPrinter(quiet=output.quiet)

    def attach(agent: Run) -> None:
        log.attach(agent)
        if printer is not None:
            printer.attach(agent)

    stdout = sys.stdout

    def show(result: RunResult) -> None:
        log.finish()
        if printer is None:
            with redirect_stdout(stdout):
                say_json(result.to_json(), indent=2)
        else:
            printer.finish(result)

    is_shown = False  # whether `wait_for_user` has shown the result

    def wait_for_user(result: RunResult, servers: Sequence[RunServer]) -> Callable[[], bool]:
        """Show the result while the servers continue, and tell the user how to end them."""
        nonlocal is_shown
        is_shown = True
        show(result)
        server_names = " and ".join(server.lingering_name for server in servers if server.lingering_name)
        end_keys = "Enter or Ctrl-C" if sys.stdin.isatty() else "Ctrl-C"
        say(f"Serving {server_names} until {end_keys}", err=True, flush=True)
        return _read_enter

    # with --json, stdout is only for the result, not for the output of the prompt of --break
    with explaining_mistakes(options), redirect_stdout(sys.stderr if output.as_json else stdout):
        result = run_scenario(options, log, attach, wait_for_user=wait_for_user)
    if not is_shown:
        show(result)
    # CLIPS and Lua notice some mistakes only when a rule fires or a skill runs, and without a place.
    for mistake_text in mistakes(options) if result.status in (UNSUCCESSFUL, TIMED_OUT) else ():
        say_text(mistake_text, err=True)
    return result.status


def _read_enter() -> bool:
    """Read a line if it waits at the terminal; return whether a user has pressed Enter or Ctrl-D."""
    if not sys.stdin.isatty() or not select.select([sys.stdin], [], [], 0)[0]:
        return False
    sys.stdin.readline()  # the shell would read a line that is left
    return True
