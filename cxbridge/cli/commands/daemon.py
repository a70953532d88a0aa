"""``cxbridge daemon``: blackboard, transports, Skiller and executive as one long-lived process."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, AsJson, Connect, ask_daemon, connect
from cxbridge.cli.console import ConsoleOptions, local_time, say, say_result
from cxbridge.cli.discovery import group_rows, make_group_class
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups
from cxbridge.cli.styling import StyledCommand
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.plugins import package_hint

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cxbridge.blackboard import BlackBoard

_COMMAND_TIMEOUT_S = 30.0  # a reset loads all files of an agent, which takes seconds
_WHERE_TIMEOUT_S = 5.0  # for the place of a stop; a stuck main loop does not reply


# Click documents parse_args and shell_complete as the interface for subclasses of groups. Mypy does not know
# the base class, because a function makes it.
class _StartByDefault(make_group_class(lambda: group_rows("daemon"), {})):  # type: ignore[misc]
    """Passes arguments without a command to ``start``: ``daemon CONFIG`` means ``daemon start CONFIG``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        has_command = args and (args[0] in self.commands or args[0] in ("-h", "--help"))
        name = args[0] if args and not has_command and not args[0].startswith("-") else ""
        # a missing plug-in's command would otherwise be taken for CONFIG
        if (hint := package_hint(name)) and not Path(name).exists():
            raise CxbridgeError(f"there is no command 'daemon {name}'", hint=hint)
        # a completion without arguments lists the commands
        if not has_command and (args or not ctx.resilient_parsing):
            args = ["start", *args]
        return list(super().parse_args(ctx, args))

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        # the commands of the group, and what `start` completes, such as CONFIG
        completions: list[Any] = super().shell_complete(ctx, incomplete)
        command_names = {completion.value for completion in completions}
        start = self.commands["start"]
        with start.make_context("start", [], parent=ctx, resilient_parsing=True) as start_ctx:
            start_completions = start.shell_complete(start_ctx, incomplete)
        return completions + [
            completion for completion in start_completions if completion.value not in command_names
        ]


app = typer.Typer(name="daemon", cls=_StartByDefault)


@app.callback()
def _daemon() -> None:
    """Serve a blackboard, with Skiller and executive, until SIGINT or SIGTERM.

    `cxbridge daemon [CONFIG] [OPTIONS]` is short for `cxbridge daemon start`: see its --help.
    """


@app.command(cls=StyledCommand)
@option_groups
@handle_signals(is_service=True)
def start(options: DaemonOptions, console: ConsoleOptions) -> int:
    """Serve a blackboard, with Skiller and executive, in the foreground until SIGINT or SIGTERM.

    Options override CONFIG. Exit status: 0 stopped on request; 2 bad input; 4 a component failed.

    Example: cxbridge daemon start scenarios/test-scenario --web
    """
    from cxbridge.daemon.daemon import Daemon
    from cxbridge.run.explainers import explaining_mistakes

    daemon = Daemon(options, console.make_log(info=True))
    with explaining_mistakes(daemon.options):
        return daemon.run()


@app.command()
def status(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """Show the state of a daemon and its components.

    Exit status: 0 all components are active; 1 some components are not; 2 there is no daemon.

    Example: cxbridge daemon status
    """
    from cxbridge.daemon.client import read_status

    with connect(url, None) as board:
        daemon_status = read_status(board)
        daemon_status["stop"] = _read_stop(board) if daemon_status["stopped"] else None
    say_result(daemon_status, _format_status(daemon_status), as_json=as_json)
    return 0 if daemon_status["state"] == "RUNNING" else 1


@app.command()
def pause(url: Connect = DEFAULT_URL) -> int:
    """Pause the Skiller and the executive; the daemon still serves clients.

    Example: cxbridge daemon pause
    """
    return _send_command(url, "Pause")


@app.command()
def resume(url: Connect = DEFAULT_URL) -> int:
    """Resume paused components, and stopped rules.

    Example: cxbridge daemon resume
    """
    return _send_command(url, "Resume")


@app.command()
def reset(url: Connect = DEFAULT_URL) -> int:
    """Stop the Skiller and the executive, and start them again.

    Example: cxbridge daemon reset
    """
    return _send_command(url, "Reset")


@app.command()
def interrupt(url: Connect = DEFAULT_URL) -> int:
    """Interrupt the running rule, as an error in the rule does; the next cycle runs normally.

    Use this for a rule that never ends; `status` names it.

    Example: cxbridge daemon interrupt
    """
    return _send_command(url, "Interrupt")


@app.command()
def shutdown(url: Connect = DEFAULT_URL) -> int:
    """End the daemon.

    Example: cxbridge daemon shutdown --connect tcp://127.0.0.1:1911
    """
    return _send_command(url, "Shutdown")


def _send_command(url: str, verb: str) -> int:
    """Send a command to a daemon; return the exit status."""
    from cxbridge.daemon.client import send_command

    with connect(url, None) as board:
        if send_command(board, verb, _COMMAND_TIMEOUT_S):
            return 0
    say(f"the daemon did not {verb.lower()} within {_COMMAND_TIMEOUT_S:g} s", err=True)
    return TIMED_OUT


def _read_stop(board: BlackBoard) -> dict[str, Any] | None:
    """Return the place at which a daemon's rules are stopped; None if the daemon does not answer in time."""
    from cxbridge.daemon.client import NoAnswerError, request

    try:
        stop: dict[str, Any] | None = request(board, "where", _WHERE_TIMEOUT_S)
    except NoAnswerError:
        return None
    return stop


def _format_status(daemon_status: dict[str, Any]) -> Iterator[str]:
    yield (
        f"cxbridge {daemon_status['version']} is {daemon_status['state'].lower()}, "
        f"pid {daemon_status['pid']}, started {local_time(daemon_status['started_us'])}, "
        f"clock {daemon_status['clock']}"
    )
    yield f"at {daemon_status['endpoints']}"
    for skiller, controller in daemon_status["controllers"].items():
        yield f"Skiller {skiller} is controlled by {controller}"
    if daemon_status["stopped"]:
        yield f"rules are stopped {daemon_status['stopped']}"
    if (stop := daemon_status["stop"]) is not None:
        breakpoint_text = f"breakpoint {stop['breakpoint']}; " if stop["breakpoint"] else ""
        yield f"  {breakpoint_text}fired last: {stop['rule'] or '-'}; next: {stop['next_rule'] or '-'}"
    yield from (f"  {line}" for line in _format_components(daemon_status["components"]))


def _format_components(components: Sequence[Mapping[str, str]]) -> Iterator[str]:
    width = max((len(component["name"]) for component in components), default=0)
    for component in components:
        state, reason = component["state"].lower(), component["reason"]
        yield f"{component['name']:{width}}  {state:12}  {reason}".rstrip()


@app.command()
def component(
    name: Annotated[
        str,
        typer.Argument(metavar="[NAME]", help="Name of the component; all by default.", show_default=False),
    ] = "",
    transition: Annotated[
        str, typer.Argument(metavar="[configure|activate|deactivate|cleanup|shutdown]", show_default=False)
    ] = "",
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> int:
    """List the components in the order of their start, or change the state of a component by a transition.

    Exit status: 0 done; 2 the component is unknown, its state does not allow the transition, or it fails.

    Example: cxbridge daemon component executive deactivate
    """
    if transition:
        ask_daemon(url, "component-change", component=name, transition=transition)
    components = ask_daemon(url, "component-list")
    selected_components = [row for row in components if row["name"] == name] if name else components
    if not selected_components:
        raise CxbridgeError(
            f"there is no component '{name}'",
            hint=f"there are: {', '.join(row['name'] for row in components)}",
        )
    say_result(selected_components, _format_components(selected_components), as_json=as_json)
    return 0
