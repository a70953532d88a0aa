"""``cxbridge skill``: let a Skiller execute skills, and look at it."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import (
    DEFAULT_URL,
    TIMED_OUT,
    AsJson,
    Connect,
    InterfaceDirs,
    connect,
    say_unmatched,
)
from cxbridge.cli.console import ConsoleLog, say, say_json, say_text
from cxbridge.cli.option_groups import INTERFACE_DIR, option_groups
from cxbridge.cli.orderly import orderly
from cxbridge.daemon.services.options import ExecutorOptions
from cxbridge.file_access import write_file
from cxbridge.printing import one_line, terminal_of

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.blackboard.following import Deadline, InterfaceChange

app = typer.Typer(name="skill", no_args_is_help=True)

Skiller = Annotated[str, typer.Option(metavar="ID", help="the Skiller, by the id of its interface")]
_LIST_S = 3.0


@app.callback()
def _skill() -> None:
    """Let a Skiller execute skills, in a cxbridge daemon or in a Fawkes, and look at it."""


@app.command("exec")
def execute(
    skill_string: Annotated[str, typer.Argument(metavar="SKILL_STRING", help="e.g. 'say{text=\"hi\"}'")],
    url: Connect = DEFAULT_URL,
    skiller: Skiller = "Skiller",
    steal: Annotated[
        bool, typer.Option("--steal", help="take control, even from a client that has it")
    ] = False,
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="until the skill is over")] = True,
    timeout: Annotated[float | None, typer.Option(min=0, help="stop the skill after SECONDS")] = None,
    interface_dir: InterfaceDirs = None,
    as_json: AsJson = False,
) -> int:
    """Execute a skill string under exclusive control, and wait for its outcome.

    Ctrl-C stops the skill. With --no-wait the skill continues after the end of the command.

    Exit status: 0 it is final; 1 it failed, was stopped, or another client has control; 2 bad usage, no
    Skiller; 3 the timeout passed; 130 interrupted.

    Example: cxbridge skill exec 'say{text="hi"}'
    """
    from cxbridge.skiller.client.calls import SkillerCall

    progress = _Progress(skill_string)
    with (
        connect(url, interface_dir) as board,
        SkillerCall(board, skiller=skiller, steal=steal, on_status=progress.show) as call,
    ):
        if not wait:
            msgid = call.start(skill_string)
            say(json.dumps({"msgid": msgid}) if as_json else msgid)
            return 0
        try:
            result = call.execute(skill_string, timeout)
        finally:
            progress.end()
    word = result.outcome.name.lower().replace("_", " ")
    if as_json:
        say_json({"outcome": word, "error": result.error, "msgid": result.msgid})
    else:
        say(f"{word}: {result.error}" if result.error else word)
    return result.outcome.value


@app.command("list")
def list_skills(
    url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None, as_json: AsJson = False
) -> None:
    """List the Skillers, their states, controllers and skills.

    Example: cxbridge skill list
    """
    from cxbridge.blackboard.exclusive_control import name_controller
    from cxbridge.interfaces.assignments import plain
    from cxbridge.skiller.client.calls import OWNER, TYPE, skill_names

    rows: list[dict[str, Any]] = []
    names: dict[str, str] = {}
    with connect(url, interface_dir) as board:
        for info in board.list(TYPE):
            if not info.has_writer:
                continue
            with board.open_for_reading(TYPE, info.id, owner=OWNER) as instance:
                instance.read()
                row: dict[str, Any] = {"skiller": info.id}
                for name, value in instance.as_dict().items():
                    row[name] = plain(value)
                names[info.id] = name_controller(instance, row["exclusive_controller"])
            row["skills"] = skill_names(board, info.id, _LIST_S)
            rows.append(row)
    if as_json:
        say_json(rows, indent=2)
        return
    for row in rows:
        control = names[row["skiller"]]
        say(f"{row['skiller']}: {row['status']} {row['skill_string']!r}, controlled by {control}")
        for name in row["skills"] or ():
            say(f"  {name}")
        if row["skills"] is None:
            say("  (it does not tell its skills)")
    if not rows:
        say("there is no Skiller", err=True)


@app.command()
@option_groups
@orderly(service=True)
def executor(
    options: ExecutorOptions,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="log errors only")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="log everything")] = False,
) -> None:
    """Execute skills of an agent on the skill board, until SIGINT or SIGTERM.

    The class is Python code, and is run. Exit status: 0 stopped; 2 there is no such class, no server at the
    URL, or the id is taken.

    Example: cxbridge skill executor robot.py:Arm --agent robot1
    """
    from cxbridge.daemon.services.executor import run_executor

    run_executor(options, console=ConsoleLog(quiet=quiet, verbose=verbose, info=True))


@app.command("board")
def show_board(
    url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None, as_json: AsJson = False
) -> None:
    """List the executors on the skill board, their skills and their work.

    Example: cxbridge skill board
    """
    from cxbridge.daemon.services.executor import board_rows

    with connect(url, interface_dir) as board:
        rows = board_rows(board)
    if as_json:
        say_json(rows, indent=2)
        return
    for row in rows:
        doing = f": {row['skill']} for {row['board']}, action {row['master']}" if row["skill"] else ""
        say(f"{row['agent']}: {row['executor']} ({', '.join(row['skills'])}) {row['state']}{doing}")
    if not rows:
        say("there is no executor", err=True)


@app.command()
def monitor(
    url: Connect = DEFAULT_URL,
    skiller: Skiller = "Skiller",
    count: Annotated[int | None, typer.Option(min=1, help="end after N changes")] = None,
    timeout: Annotated[float | None, typer.Option(min=0, help="end after SECONDS")] = None,
    lines: Annotated[bool, typer.Option("--lines", help="print lines on a terminal, too")] = False,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object a line")] = False,
) -> int:
    """Follow the states of a Skiller.

    On a terminal: its skill string and status, and the state machine of the running skill with the state that
    it is in and the way there. Elsewhere: one line when skill string, status, error or controller changes.

    Exit status: 0 after --count changes or without --count; 3 when --timeout came first; 130 after Ctrl-C.

    Example: cxbridge skill monitor --lines
    """
    from cxbridge.blackboard.following import Deadline

    deadline = Deadline(timeout)
    with connect(url, interface_dir) as board:
        say_unmatched(board, [f"SkillerInterface::{skiller}"])
        if sys.stdout.isatty() and not lines and not as_json:
            from cxbridge.cli.commands.skill.live import show

            done = show(board, skiller, count, deadline)
        else:
            done = _print_lines(board, skiller, count, deadline, as_json=as_json)
    return 0 if count is None or done else TIMED_OUT


def _print_lines(
    board: BlackBoard, skiller: str, count: int | None, deadline: Deadline, *, as_json: bool
) -> bool:
    """Print a line for each change; returns whether there were ``count``."""
    from cxbridge.blackboard.following import Feed
    from cxbridge.skiller.client.calls import OWNER, TYPE

    printed, before = 0, ""
    with Feed(board, OWNER) as feed:
        news: InterfaceChange | None = feed.now(feed.open(TYPE, skiller))
        while news is not None:
            line = _monitor_line(news, as_json=as_json)
            if line != before:
                before, printed = line, printed + 1
                say(line, flush=True)
            if printed == count:
                return True
            news = feed.next(deadline)
    return False


@dataclass(frozen=True, kw_only=True)
class _SkillFiles:
    """Where skills and interface definitions lie."""

    space: Annotated[str, typer.Option(help="the skill space, without --connect")] = "test"
    skill_dirs: Annotated[
        tuple[Path, ...], typer.Option("--skill-dir", metavar="DIR", help="a folder with Lua skills")
    ] = ()
    fawkes_dir: Annotated[Path | None, typer.Option(metavar="DIR", help="a Fawkes checkout")] = None
    interface_dirs: Annotated[tuple[Path, ...], INTERFACE_DIR] = ()

    def folders(self) -> tuple[list[Path], list[Path]]:
        """Return the folders of the skills, and those of the interface definitions."""
        from cxbridge.skiller.make import FAWKES_INTERFACES_DIR, skill_folders

        interface_dirs = [*self.interface_dirs]
        if self.fawkes_dir is not None:
            interface_dirs.append(self.fawkes_dir / FAWKES_INTERFACES_DIR)
        return skill_folders(self.skill_dirs, self.fawkes_dir), interface_dirs


@app.command()
@option_groups
def graph(
    skill: Annotated[
        str,
        typer.Argument(
            metavar="SKILL",
            help="a skill's name; SKILL_DEP: which skill uses which; with --connect also ACTIVE",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="FILE.svg, .png, .pdf or .dot; else dot to stdout"
        ),
    ] = None,
    url: Annotated[
        str | None,
        typer.Option("--connect", metavar="URL", help="ask the Skiller there, of a daemon or a Fawkes"),
    ] = None,
    skiller: Skiller = "Skiller",
    direction: Annotated[
        str | None, typer.Option(metavar="TB|BT|LR|RL", help="from top to bottom, ..., from right to left")
    ] = None,
    colour: Annotated[bool | None, typer.Option("--color/--no-color", show_default=False)] = None,
    *,
    files: _SkillFiles,
) -> int:
    """Draw the state machine of a skill: from the skill files, or as a running Skiller shows it.

    Exit status: 0 done; 2 bad usage, no such skill, no server, or no graphviz.

    Example: cxbridge skill graph goto -o goto.svg --skill-dir skills
    """
    from cxbridge.errors import CxbridgeError
    from cxbridge.skiller.client.graphs import DIRECTIONS, PICTURES, draw_graph, fetch_graph, render

    if direction not in (None, *DIRECTIONS):
        raise CxbridgeError(
            f"--direction cannot be '{direction}'", hint=f"use one of: {', '.join(DIRECTIONS)}"
        )
    if output is not None and output.suffix not in (*PICTURES, ".dot"):
        raise CxbridgeError(
            "the name does not tell the format", file=output, hint="use .svg, .png, .pdf or .dot"
        )
    if url is None:
        text = draw_graph(
            skill,
            *files.folders(),
            space=files.space,
            direction=direction or "TB",
            coloured=colour is not False,
        )
    else:
        with connect(url, files.interface_dirs) as board:
            text = fetch_graph(board, skiller, skill, direction=direction, coloured=colour)
    if output is None:
        say_text(text, end="" if text.endswith("\n") else "\n")
    else:
        write_file(output, text if output.suffix == ".dot" else render(text, output.suffix))
    return 0


def _monitor_line(news: InterfaceChange, *, as_json: bool) -> str:
    """Return the state of a Skiller, for people or programs."""
    from cxbridge.interfaces.assignments import plain

    if news.kind == "writer removed":
        return json.dumps({"status": "gone"}) if as_json else "the Skiller is gone"
    values = {name: plain(value) for name, value in news.values.items()}
    if as_json:
        return json.dumps(values, ensure_ascii=False)
    error = f"  [{values['error']}]" if values["error"] else ""
    control = values["exclusive_controller"] or "nobody"
    return (
        f"{values['status']:10}  {values['msgid']:5}  {values['skill_string']}{error}  (control: {control})"
    )


class _Progress:
    """A line on a terminal that says how the skill stands; nothing elsewhere."""

    def __init__(self, skill_string: str) -> None:
        self._skill_string = skill_string
        self._shown = False

    def show(self, status: str, error: str) -> None:
        """Show a new status."""
        if sys.stderr.isatty():
            line = one_line(f"{status} {self._skill_string} {error}".rstrip())
            terminal_of(sys.stderr).write(f"\r\x1b[K{line}")
            sys.stderr.flush()
            self._shown = True

    def end(self) -> None:
        """Take the line away."""
        if self._shown:
            terminal_of(sys.stderr).write("\r\x1b[K")
            sys.stderr.flush()
