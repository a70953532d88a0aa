"""``cxbridge skill monitor`` and ``skill graph``: print states of a Skiller, and graphs of its skills."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.commands.skill import Skiller
from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, Connect, InterfaceDirs, connect, say_unmatched
from cxbridge.cli.console import say, say_text
from cxbridge.cli.option_groups import INTERFACE_DIR_OPTION, option_groups

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.blackboard.following import Deadline, InterfaceChange


def monitor(
    url: Connect = DEFAULT_URL,
    skiller: Skiller = "Skiller",
    count: Annotated[int | None, typer.Option(min=1, help="End after N lines.")] = None,
    timeout: Annotated[float | None, typer.Option(min=0, help="End after SECONDS.")] = None,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON object per line.")] = False,
) -> int:
    """Follow the states of a Skiller: a line with the present state, and a line after each change.

    Exit status: 0 after --count lines or without --count; 3 when --timeout came first; 130 after Ctrl-C.

    Example: cxbridge skill monitor --timeout 60
    """
    from cxbridge.blackboard.following import Deadline

    deadline = Deadline(timeout)
    with connect(url, interface_dir) as board:
        say_unmatched(board, [f"SkillerInterface::{skiller}"])
        is_done = _print_lines(board, skiller, count, deadline, as_json=as_json)
    return 0 if count is None or is_done else TIMED_OUT


def _print_lines(
    board: BlackBoard, skiller: str, count: int | None, deadline: Deadline, *, as_json: bool
) -> bool:
    """Print the present state and each later state that looks different, one on a line.

    :param count: the number of lines after which to return; None without a limit.
    :returns: whether ``count`` lines were printed; False after the deadline.
    """
    from cxbridge.blackboard.following import Feed
    from cxbridge.skiller.calls import OWNER, SKILLER_TYPE

    printed_count, previous_line = 0, ""
    with Feed(board, OWNER) as feed:
        change: InterfaceChange | None = feed.read_state(feed.open(SKILLER_TYPE, skiller))
        while change is not None:
            line = _format_state(change, as_json=as_json)
            # not at each event: a write may leave all values unchanged, and a new writer is an event, too
            if line != previous_line:
                previous_line, printed_count = line, printed_count + 1
                say(line, flush=True)
            if printed_count == count:
                return True
            change = feed.wait_for_change(deadline)
    return False


@dataclass(frozen=True, kw_only=True)
class _SkillFiles:
    """The options for the folders of skills and interface definitions."""

    space: Annotated[str, typer.Option(help="The skill space, without --connect.")] = "test"
    skill_dirs: Annotated[
        tuple[Path, ...], typer.Option("--skill-dir", metavar="DIR", help="A folder with Lua skills.")
    ] = ()
    fawkes_dir: Annotated[Path | None, typer.Option(metavar="DIR", help="A Fawkes checkout.")] = None
    interface_dirs: Annotated[tuple[Path, ...], INTERFACE_DIR_OPTION] = ()

    def find_folders(self) -> tuple[list[Path], list[Path]]:
        """Return the folders of the skills, and those of the interface definitions."""
        from cxbridge.skiller.make import FAWKES_INTERFACES_DIR, skill_folders

        interface_dirs = [*self.interface_dirs]
        if self.fawkes_dir is not None:
            interface_dirs.append(self.fawkes_dir / FAWKES_INTERFACES_DIR)
        return skill_folders(self.skill_dirs, self.fawkes_dir), interface_dirs


@option_groups
def graph(
    skill: Annotated[
        str,
        typer.Argument(
            metavar="SKILL",
            help="The name of a skill; SKILL_DEP for the dependencies of skills; with --connect also ACTIVE.",
        ),
    ],
    url: Annotated[
        str | None,
        typer.Option("--connect", metavar="URL", help="Ask the Skiller of this daemon or Fawkes server."),
    ] = None,
    skiller: Skiller = "Skiller",
    *,
    files: _SkillFiles,
) -> None:
    """Print the state machine of a skill for Graphviz, from the skill files or from a running Skiller.

    Exit status: 0 done; 2 bad usage, no such skill, or no server.

    Example: cxbridge skill graph goto --skill-dir skills
    """
    from cxbridge_studio.skill_graphs import fetch_graph, make_graph

    if url is None:
        dot = make_graph(skill, *files.find_folders(), space=files.space)
    else:
        with connect(url, files.interface_dirs) as board:
            dot = fetch_graph(board, skiller, skill)
    say_text(dot, end="" if dot.endswith("\n") else "\n")


def _format_state(change: InterfaceChange, *, as_json: bool) -> str:
    """Return the state of a Skiller as a line of text or JSON."""
    from cxbridge.interfaces.assignments import json_value

    if change.kind == "writer removed":
        return json.dumps({"status": "gone"}) if as_json else "the Skiller is gone"
    values = {name: json_value(value) for name, value in change.values.items()}
    if as_json:
        return json.dumps(values, ensure_ascii=False)
    error = f"  [{values['error']}]" if values["error"] else ""
    control = values["exclusive_controller"] or "nobody"
    return (
        f"{values['status']:10}  {values['msgid']:5}  {values['skill_string']}{error}  (control: {control})"
    )
