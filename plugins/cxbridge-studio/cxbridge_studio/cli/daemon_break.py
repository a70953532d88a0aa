"""``cxbridge daemon break`` and ``step``: the debugger of a daemon's rules; ``component``: its parts."""

from __future__ import annotations

from typing import Annotated, Any, Final

import typer

from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, AsJson, Connect, connect
from cxbridge.cli.console import say, say_json
from cxbridge.errors import CxbridgeError

ANSWER_S: Final = 30.0
"""Seconds that a daemon has to answer."""

breaks = typer.Typer(
    name="break", help="Breakpoints at rules, transitions and skills of a daemon's executive."
)


@breaks.command()
def add(
    specs: Annotated[
        list[str],
        typer.Argument(metavar="SPEC...", help="e.g. rule:NAME, goal:CLASS:MODE; docs/debugging.md"),
    ],
    url: Connect = DEFAULT_URL,
) -> int:
    """Add breakpoints.

    Example: cxbridge daemon break add rule:goal-reasoner-select goal:TALK:FINISHED
    """
    return _print_breakpoints(ask_daemon(url, "break-add", specs=specs))


@breaks.command("list")
def list_breakpoints(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """List the breakpoints, and where the rules are stopped.

    Example: cxbridge daemon break list
    """
    found, stop = ask_daemon(url, "break-list"), ask_daemon(url, "where")
    if as_json:
        say_json({"breakpoints": found, "stopped": stop}, indent=2)
        return 0
    _print_breakpoints(found)
    if stop is not None:
        number = f" (breakpoint {stop['breakpoint']})" if stop["breakpoint"] else ""
        say(f"stopped {stop['reason']}{number}")
        say(f"  fired last: {stop['rule'] or '-'}; next: {stop['next_rule'] or '-'}")
    return 0


@breaks.command()
def remove(
    numbers: Annotated[list[int] | None, typer.Argument(metavar="NUMBER...", show_default=False)] = None,
    everything: Annotated[bool, typer.Option("--all", help="all of them")] = False,
    url: Connect = DEFAULT_URL,
) -> int:
    """Remove breakpoints. Rules that are stopped stay so: 'cxbridge daemon resume' continues them.

    Example: cxbridge daemon break remove 1 2
    """
    if not numbers and not everything:
        raise typer.BadParameter(
            "which? 'cxbridge daemon break list' lists them", param_hint="NUMBER... or --all"
        )
    ask_daemon(url, "break-remove", numbers=numbers or [], all=everything)
    return 0


def step(
    unit: Annotated[str, typer.Argument(metavar="rule|loop|transition")] = "rule",
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Seconds to wait for the end of the step.")
    ] = 10.0,
    url: Connect = DEFAULT_URL,
) -> int:
    """Let the rules take a step, and report where they are then; rules that run stop after it.

    Exit status: 0 done; 2 there is no such step, or no daemon; 3 the step has not ended in time.

    Example: cxbridge daemon step transition
    """
    from cxbridge.daemon import client as daemon_client

    with connect(url, None) as board:
        where = daemon_client.step(board, unit, timeout)
    if not where:
        say(f"the step has not ended within {timeout:g} s; it goes on", err=True)
        return TIMED_OUT
    say(f"stopped {where}")
    return 0


def component(
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help="which; all by default", show_default=False)
    ] = "",
    transition: Annotated[
        str, typer.Argument(metavar="[configure|activate|deactivate|cleanup|shutdown]", show_default=False)
    ] = "",
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> int:
    """Report how components stand, in the order of their start, or let one take a step of its life.

    Exit status: 0 done; 2 there is no such component, it is in no state for that step, or it fails.

    Example: cxbridge daemon component executive deactivate
    """
    if transition:
        ask_daemon(url, "component-change", component=name, transition=transition)
    every = ask_daemon(url, "component-list")
    found = [row for row in every if row["name"] == name] if name else every
    if not found:
        known = ", ".join(row["name"] for row in every)
        raise CxbridgeError(f"there is no component '{name}'", hint=f"there are: {known}")
    if as_json:
        say_json(found, indent=2)
        return 0
    width = max(len(row["name"]) for row in found)
    for row in found:
        say(f"{row['name']:{width}}  {row['state'].lower():12}  {row['reason']}".rstrip())
    return 0


def ask_daemon(url: str, verb: str, **arguments: Any) -> Any:
    """Have a daemon do something; see :func:`cxbridge.daemon.client.request`."""
    from cxbridge.daemon.client import request

    with connect(url, None) as board:
        return request(board, verb, ANSWER_S, **arguments)


def _print_breakpoints(found: list[dict[str, Any]]) -> int:
    for item in found:
        say(f"{item['number']}  {item['spec']}")
    return 0
