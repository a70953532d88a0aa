"""``cxbridge daemon break`` and ``daemon step``: debug the rules of a daemon."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, AsJson, Connect, ask_daemon, connect
from cxbridge.cli.console import say, say_json
from cxbridge.errors import BlackBoardError

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard

breaks = typer.Typer(
    name="break", help="Breakpoints at rules, transitions and skills of a daemon's executive."
)


@breaks.command()
def add(
    specs: Annotated[
        list[str],
        typer.Argument(
            metavar="SPEC...", help="Breakpoints, e.g. rule:NAME, goal:CLASS:MODE; see docs/debugging.md."
        ),
    ],
    url: Connect = DEFAULT_URL,
) -> None:
    """Add breakpoints.

    Example: cxbridge daemon break add rule:goal-reasoner-select goal:TALK:FINISHED
    """
    _print_breakpoints(ask_daemon(url, "break-add", specs=specs))


@breaks.command("list")
def list_breakpoints(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> None:
    """List the breakpoints, and show where the rules are stopped.

    Example: cxbridge daemon break list
    """
    breakpoints, stop = ask_daemon(url, "break-list"), ask_daemon(url, "where")
    if as_json:
        say_json({"breakpoints": breakpoints, "stopped": stop}, indent=2)
        return
    _print_breakpoints(breakpoints)
    if stop is not None:
        breakpoint_note = f" (breakpoint {stop['breakpoint']})" if stop["breakpoint"] else ""
        say(f"stopped {stop['reason']}{breakpoint_note}")
        say(f"  fired last: {stop['rule'] or '-'}; next: {stop['next_rule'] or '-'}")


@breaks.command()
def remove(
    numbers: Annotated[list[int] | None, typer.Argument(metavar="NUMBER...", show_default=False)] = None,
    remove_all: Annotated[bool, typer.Option("--all", help="Remove all breakpoints.")] = False,
    url: Connect = DEFAULT_URL,
) -> None:
    """Remove breakpoints. Stopped rules stay stopped until 'cxbridge daemon resume'.

    Example: cxbridge daemon break remove 1 2
    """
    if not numbers and not remove_all:
        raise typer.BadParameter(
            "missing; 'cxbridge daemon break list' lists the numbers", param_hint="NUMBER... or --all"
        )
    ask_daemon(url, "break-remove", numbers=numbers or [], all=remove_all)


def step(
    unit: Annotated[str, typer.Argument(metavar="rule|loop|transition")] = "rule",
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Seconds to wait for the end of the step.")
    ] = 10.0,
    url: Connect = DEFAULT_URL,
) -> int:
    """Let the rules take a step, and report where they stop; running rules also stop after the step.

    Exit status: 0 done; 2 there is no such step, or no daemon; 3 the step did not end in time.

    Example: cxbridge daemon step transition
    """
    with connect(url, None) as board:
        stop_text = _take_step(board, unit, timeout)
    if not stop_text:
        say(f"the step has not ended within {timeout:g} s; it continues", err=True)
        return TIMED_OUT
    say(f"stopped {stop_text}")
    return 0


def _print_breakpoints(breakpoints: list[dict[str, Any]]) -> None:
    for row in breakpoints:
        say(f"{row['number']}  {row['spec']}")


def _take_step(board: BlackBoard, unit: str, timeout_s: float) -> str:
    """Let the rules of a daemon take a step, and wait for the end of the step.

    :param unit: the step: ``rule``, ``loop`` or ``transition``.
    :param timeout_s: the limit for the daemon's reply, and for the end of the step.
    :returns: where the rules have stopped; empty if they do not stop in time.
    :raises NoAnswerError: if the daemon does not reply in time.
    :raises CxbridgeError: if there is no daemon, or it has no executive, refuses the request or ends.
    """
    from cxbridge.blackboard.following import Deadline, Feed
    from cxbridge.daemon.client import OWNER, check_daemon, request
    from cxbridge.daemon.interfaces import DAEMON_ID, REQUEST_TYPE

    check_daemon(board)
    deadline = Deadline(timeout_s)
    with Feed(board, OWNER) as feed:
        previous_stops = feed.read_state(feed.open(REQUEST_TYPE, DAEMON_ID)).values["stops"]
        # the daemon counts the stops of its rules: a new count means the end of this step
        request(board, "step", timeout_s, what=unit)
        while (change := feed.wait_for_change(deadline)) is not None:
            if change.kind == "writer removed":
                raise BlackBoardError("the daemon has ended")
            if change.values["stops"] != previous_stops and change.values["stopped"]:
                return str(change.values["stopped"])
    return ""
