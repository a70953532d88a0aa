"""``cxbridge skill``: execute skills, and list Skillers and executors."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import (
    DEFAULT_URL,
    AsJson,
    Connect,
    InterfaceDirs,
    connect,
)
from cxbridge.cli.console import ConsoleLog, progress_line, say, say_result
from cxbridge.cli.discovery import group_rows, make_group_class
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups
from cxbridge.daemon.services.options import ExecutorOptions

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

app = typer.Typer(name="skill", cls=make_group_class(lambda: group_rows("skill"), {}), no_args_is_help=True)

Skiller = Annotated[str, typer.Option(metavar="ID", help="Id of the Skiller's interface.")]
_LIST_TIMEOUT_S = 3.0  # seconds to wait for the list of skills, which Fawkes does not send


@app.callback()
def _skill() -> None:
    """Execute skills in a cxbridge daemon or in Fawkes, and list Skillers and executors."""


@app.command("exec")
def execute(
    skill_string: Annotated[
        str, typer.Argument(metavar="SKILL_STRING", help="A skill string, e.g. 'say{text=\"hi\"}'.")
    ],
    url: Connect = DEFAULT_URL,
    skiller: Skiller = "Skiller",
    steal: Annotated[bool, typer.Option("--steal", help="Take control even from another client.")] = False,
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="Wait for the end of the skill.")] = True,
    timeout: Annotated[float | None, typer.Option(min=0, help="Stop the skill after SECONDS.")] = None,
    interface_dir: InterfaceDirs = None,
    as_json: AsJson = False,
) -> int:
    """Execute a skill string under exclusive control, and wait for its outcome.

    Ctrl-C stops the skill. With --no-wait the skill continues after the end of the command.

    Exit status: 0 the skill is final, or has started with --no-wait; 1 the skill failed or was stopped, or
    another client has control; 2 bad usage, there is no Skiller, or another client has control with
    --no-wait; 3 the time limit was exceeded; 130 interrupted.

    Example: cxbridge skill exec 'say{text="hi"}'
    """
    from cxbridge.skiller.calls import SkillerCall

    with (
        connect(url, interface_dir) as board,
        progress_line(hidden=not wait) as show,
        SkillerCall(
            board,
            skiller=skiller,
            steal=steal,
            on_status=lambda status, error: show(f"{status} {skill_string} {error}".rstrip()),
        ) as call,
    ):
        if not wait:
            msgid = call.start(skill_string)
            say(json.dumps({"msgid": msgid}) if as_json else msgid)
            return 0
        result = call.execute(skill_string, timeout)
    outcome = result.outcome.name.lower().replace("_", " ")
    result_object = {"outcome": outcome, "error": result.error, "msgid": result.msgid}
    say_result(
        result_object,
        [f"{outcome}: {result.error}" if result.error else outcome],
        as_json=as_json,
        indent=None,
    )
    return result.outcome.value


@app.command("list")
def list_skills(
    url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None, as_json: AsJson = False
) -> None:
    """List the Skillers with their states, controllers and skills.

    Example: cxbridge skill list
    """
    from cxbridge.blackboard.exclusive_control import describe_controller
    from cxbridge.interfaces.assignments import json_value
    from cxbridge.skiller.calls import OWNER, SKILLER_TYPE, request_skill_names

    rows: list[dict[str, Any]] = []
    controllers: dict[str, str] = {}
    with connect(url, interface_dir) as board:
        for interface in board.list(SKILLER_TYPE):
            if interface.has_writer:
                with board.open_for_reading(SKILLER_TYPE, interface.id, owner=OWNER) as instance:
                    instance.read()
                    values = {name: json_value(value) for name, value in instance.as_dict().items()}
                    controllers[interface.id] = describe_controller(instance, values["exclusive_controller"])
                rows.append(
                    {
                        "skiller": interface.id,
                        **values,
                        "skills": request_skill_names(board, interface.id, _LIST_TIMEOUT_S),
                    }
                )
    say_result(rows, _format_skillers(rows, controllers), as_json=as_json)
    if not rows and not as_json:
        say("there is no Skiller", err=True)


def _format_skillers(rows: Iterable[Mapping[str, Any]], controllers: Mapping[str, str]) -> Iterator[str]:
    """Yield the lines of a list of Skillers.

    :param controllers: the clients with exclusive control by Skiller.
    """
    for row in rows:
        control = controllers[row["skiller"]]
        yield f"{row['skiller']}: {row['status']} {row['skill_string']!r}, controlled by {control}"
        names = ["(it does not report its skills)"] if row["skills"] is None else row["skills"]
        yield from (f"  {name}" for name in names)


@app.command()
@option_groups
@handle_signals(is_service=True)
def executor(
    options: ExecutorOptions,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False,
) -> None:
    """Execute skills of an agent on the skill board, until SIGINT or SIGTERM.

    The command runs the Python code of the class. Exit status: 0 stopped on request; 2 the class does not
    exist, no server answers at the URL, or the id is in use.

    Example: cxbridge skill executor robot.py:Arm --agent robot1
    """
    from cxbridge.daemon.services.executor import run_executor

    run_executor(options, console=ConsoleLog(quiet=quiet, verbose=verbose, info=True))


@app.command("board")
def show_board(
    url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None, as_json: AsJson = False
) -> None:
    """List the executors on the skill board with their skills, states and current actions.

    Example: cxbridge skill board
    """
    from cxbridge.daemon.services.executor import read_executor_states

    with connect(url, interface_dir) as board:
        rows = read_executor_states(board)
    say_result(rows, map(_format_executor, rows), as_json=as_json)
    if not rows and not as_json:
        say("there is no executor", err=True)


def _format_executor(row: Mapping[str, Any]) -> str:
    activity = f": {row['skill']} for {row['board']}, action {row['master']}" if row["skill"] else ""
    return f"{row['agent']}: {row['executor']} ({', '.join(row['skills'])}) {row['state']}{activity}"
