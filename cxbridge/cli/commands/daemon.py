"""``cxbridge daemon``: blackboard, transports, Skiller and executive as one long-lived process."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from cxbridge.cli import daemon_debug
from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, AsJson, Connect, connect
from cxbridge.cli.console import say, say_json
from cxbridge.cli.orderly import orderly
from cxbridge.cli.run_options import (
    BBLog,
    Core,
    Executors,
    FawkesDir,
    InterfaceDirs,
    Log,
    Quiet,
    Ros2CxDir,
    SkillDirs,
    Verbose,
)

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard

_COMMAND_S = 30.0
_WHERE_S = 5.0


class _StartByDefault(TyperGroup):
    """What is not a command's name goes to ``start``: ``daemon CONFIG`` is ``daemon start CONFIG``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        named = args and (args[0] in self.commands or args[0] in ("-h", "--help"))
        if not named and (args or not ctx.resilient_parsing):  # what is being completed is not there yet
            args = ["start", *args]
        return list(super().parse_args(ctx, args))

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        found = super().shell_complete(ctx, incomplete)
        start = self.commands["start"]
        with start.make_context("start", [], parent=ctx, resilient_parsing=True) as within:
            known = {item.value for item in found}
            return found + [
                item for item in start.shell_complete(within, incomplete) if item.value not in known
            ]


app = typer.Typer(name="daemon", cls=_StartByDefault)
app.add_typer(daemon_debug.breaks, name="break")
app.command("step")(daemon_debug.step)
app.command("component")(daemon_debug.component)


@app.callback()
def _daemon() -> None:
    """Serve a blackboard, with Skiller and executive, until SIGINT or SIGTERM.

    `cxbridge daemon [CONFIG] [OPTIONS]` is short for `cxbridge daemon start`: see its --help.
    """


@app.command()
@orderly(service=True)
def start(  # noqa: PLR0913, PLR0917  a command has as many options as it has
    config: Annotated[
        Path | None,
        typer.Argument(
            help="A scenario or a Fawkes configuration, its tree 'cxbridge:' says what to do. "
            "Without: a blackboard and a Skiller with the shipped skills.",
            show_default=False,
        ),
    ] = None,
    overlay: Annotated[
        list[Path] | None,
        typer.Option(
            "--config",
            help="A configuration file on top of CONFIG. Repeatable: each over those before it.",
            show_default=False,
        ),
    ] = None,
    endpoint: Annotated[
        list[str] | None,
        typer.Option(metavar="URL", help="Serve over ZeroMQ here: tcp://HOST:PORT, ipc://FILE. Repeatable."),
    ] = None,
    insecure: Annotated[
        bool | None, typer.Option("--insecure", help="ZeroMQ beyond this machine without CURVE keys.")
    ] = None,
    secret_key: Annotated[
        Path | None, typer.Option(help="CURVE key file of the daemon.", show_default=False)
    ] = None,
    clients: Annotated[
        Path | None, typer.Option(help="Folder with the clients' public keys.", show_default=False)
    ] = None,
    fawkes: Annotated[
        bool | None,
        typer.Option(
            "--fawkes/--no-fawkes", help="A port for Fawkes' tools; on by default.", show_default=False
        ),
    ] = None,
    fawkes_host: Annotated[str | None, typer.Option(help="Where that port is; 127.0.0.1 by default.")] = None,
    fawkes_port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Its number; 1910 by default, 0: any free one.")
    ] = None,
    fawkes_allow: Annotated[
        list[str] | None,
        typer.Option(metavar="ADDRESS", help="Who may connect to it from elsewhere. Repeatable."),
    ] = None,
    skiller: Annotated[
        str | None, typer.Option(metavar="lua|simulator|none|URL", help="Who executes skills.")
    ] = None,
    executive: Annotated[
        bool | None,
        typer.Option(
            "--executive/--no-executive", help="By default if CONFIG has specs.", show_default=False
        ),
    ] = None,
    agent: Annotated[
        str | None, typer.Option(help="Which agent it is, of a CONFIG with several.", show_default=False)
    ] = None,
    spec: Annotated[str | None, typer.Option(help="The executive's spec.")] = None,
    speech: Annotated[
        str | None, typer.Option(metavar="off|on|FILE.wav|DIR/", help="speak what skills say")
    ] = None,
    clock: Annotated[str | None, typer.Option(help="real or scaled:N.")] = None,
    fawkes_dir: FawkesDir = None,
    ros2cx: Ros2CxDir = None,
    executor: Executors = None,
    core: Core = None,
    clips_dir: Annotated[list[Path] | None, typer.Option(help="A folder of CLIPS files. Repeatable.")] = None,
    interface_dir: InterfaceDirs = None,
    skill_dir: SkillDirs = None,
    on_failure: Annotated[
        str | None, typer.Option(help="stop or continue: what the others do when a component fails.")
    ] = None,
    trace: Annotated[Path | None, typer.Option(help="Record to this mcap file.")] = None,
    log: Log = None,
    bblog: BBLog = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Serve a blackboard, with Skiller and executive, in the foreground until SIGINT or SIGTERM.

    Options win over CONFIG. Exit status: 0 stopped on request; 2 bad input; 4 a component failed.
    """
    from cxbridge.cli.console import ConsoleLog
    from cxbridge.daemon.daemon import Daemon
    from cxbridge.daemon.options import DaemonOptions

    given: dict[str, Any] = {
        "zmq/endpoints": endpoint or None,
        "zmq/insecure": insecure,
        "zmq/secret-key": _text(secret_key),
        "zmq/clients": _text(clients),
        "fawkes/enable": fawkes,
        "fawkes/host": fawkes_host,
        "fawkes/port": fawkes_port,
        "fawkes/allow": fawkes_allow or None,
        "core": core,
        "skiller": skiller,
        "executive": executive,
        "speech": speech,
        "clock": clock,
        "on-failure": on_failure,
        "record/trace": _text(trace),
        "record/log": _text(log),
        "record/bblog": _text(bblog),
    }
    options = DaemonOptions(
        config=config,
        overlay=tuple(overlay or ()),
        agent=agent,
        spec=spec,
        fawkes_dir=fawkes_dir,
        ros2cx=ros2cx,
        executors=tuple(executor or ()),
        clips_dirs=tuple(clips_dir or ()),
        interface_dirs=tuple(interface_dir or ()),
        skill_dirs=tuple(skill_dir or ()),
        settings=tuple((path, value) for path, value in given.items() if value is not None),
    )
    return Daemon(options, ConsoleLog(quiet=quiet, verbose=verbose, info=True)).run()


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path.absolute())


@app.command()
def status(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """Tell how a daemon and its components stand.

    Exit status: 0 all components are active; 1 some are not; 2 there is no daemon.
    """
    from cxbridge.daemon.client import read_status

    with connect(url, None) as board:
        row = read_status(board)
        row["stop"] = _where(board) if row["stopped"] else None
    if as_json:
        say_json(row, indent=2)
    else:
        _print_status(row)
    return 0 if row["state"] == "RUNNING" else 1


@app.command()
def pause(url: Connect = DEFAULT_URL) -> int:
    """Let Skiller and executive rest; clients are served."""
    return _command(url, "Pause")


@app.command()
def resume(url: Connect = DEFAULT_URL) -> int:
    """Let what rests work again, and rules that are stopped go on."""
    return _command(url, "Resume")


@app.command()
def reset(url: Connect = DEFAULT_URL) -> int:
    """Take Skiller and executive down and start them again."""
    return _command(url, "Reset")


@app.command()
def interrupt(url: Connect = DEFAULT_URL) -> int:
    """End what rules do at this moment, as an error in them would; the next loop is as usual.

    For a rule that does not come to its end: `status` says which.
    """
    return _command(url, "Interrupt")


@app.command()
def shutdown(url: Connect = DEFAULT_URL) -> int:
    """End the daemon."""
    return _command(url, "Shutdown")


def _command(url: str, what: str) -> int:
    """Tell a daemon what to do; 0 when it has done it, 3 when it has not answered in time."""
    from cxbridge.daemon.client import command

    with connect(url, None) as board:
        return _told(board, what, command(board, what, _COMMAND_S))


def _told(_board: BlackBoard, what: str, done: bool) -> int:
    if not done:
        say(f"the daemon did not {what.lower()} within {_COMMAND_S:g} s", err=True)
    return 0 if done else TIMED_OUT


def _where(board: BlackBoard) -> dict[str, Any] | None:
    """Return where a daemon's rules are stopped; None when they have gone on, or it does not answer."""
    from cxbridge.daemon.client import NoAnswerError, request

    try:
        stop: dict[str, Any] | None = request(board, "where", _WHERE_S)
    except NoAnswerError:
        return None
    return stop


def _print_status(row: dict[str, Any]) -> None:
    from cxbridge.cli.commands.bb import _when

    say(
        f"cxbridge {row['version']} is {row['state'].lower()}, pid {row['pid']}, "
        f"started {_when(row['started_us'])}, clock {row['clock']}"
    )
    say(f"at {row['endpoints']}")
    if row["stopped"]:
        say(f"rules are stopped {row['stopped']}")
    if (stop := row["stop"]) is not None:
        number = f"breakpoint {stop['breakpoint']}; " if stop["breakpoint"] else ""
        say(f"  {number}fired last: {stop['rule'] or '-'}; next: {stop['next_rule'] or '-'}")
    names = [len(component["name"]) for component in row["components"]]
    for component in row["components"]:
        name = component["name"].ljust(max(names))
        say(f"  {name}  {component['state'].lower():12}  {component['reason']}".rstrip())
