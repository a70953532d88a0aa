"""Options and arguments of several commands: the connection to a blackboard, and recorded runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from cxbridge.cli.console import say
from cxbridge.cli.option_groups import CONNECT_OPTION, INTERFACE_DIR_OPTION
from cxbridge.resources import DAEMON_URL

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.interfaces.registry import InterfaceRegistry

TIMED_OUT = 3
"""The exit status if an awaited event does not occur in time."""

# Seconds to wait for the reply of a daemon, which may first load the files of an agent.
REPLY_TIMEOUT_S: Final = 30.0

DEFAULT_URL = DAEMON_URL

Connect = Annotated[str, CONNECT_OPTION]
InterfaceDirs = Annotated[list[Path] | None, INTERFACE_DIR_OPTION]
Uid = Annotated[
    str, typer.Argument(metavar="TYPE::ID", help="An open interface, e.g. SkillerInterface::Skiller.")
]
Globs = Annotated[
    list[str], typer.Argument(metavar="GLOB...", help="TYPE or TYPE::ID, with the shell patterns *, ?, [].")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
RunPath = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="A recorded run: an mcap file, a text log of Fawkes, a transitions text, bblogger files, or a "
        "ROS 2 bag.",
    ),
]


def connect(url: str, interface_dirs: Sequence[Path] | None) -> BlackBoard:
    """Open the blackboard at ``url``.

    :param interface_dirs: folders of definitions that take precedence over the shipped ones; None: none.
    :raises CxbridgeError: if no server answers, or the URL is invalid.
    """
    from cxbridge.blackboard.urls import open_blackboard
    from cxbridge.clock import RealClock
    from cxbridge.interfaces.registry import InterfaceRegistry

    return open_blackboard(url, InterfaceRegistry(interface_dirs or ()), RealClock())


def say_unmatched(board: BlackBoard, globs: Sequence[str]) -> None:
    """Print to stderr the patterns that match no interface, with similar names."""
    for glob in globs:
        if not list(board.list(*split_glob(glob))):
            say(f"nothing matches {glob} yet{suggest_interface(board, glob)}", err=True)


def suggest_interface(board: BlackBoard, glob: str) -> str:
    """Return a suggestion for a pattern without matching interfaces, or an empty text.

    A pattern with ``::`` is compared with the uids of the interfaces, any other with their types.
    """
    from cxbridge.suggestions import bracketed_suggestion, nearest_names

    uids, name = [interface.uid for interface in board.list()], glob.strip("*")
    if "::" in glob:
        return bracketed_suggestion(name, uids)
    # without the common ending, which would make all types similar
    type_by_short_name = {
        uid.partition("::")[0].removesuffix("Interface"): uid.partition("::")[0] for uid in uids
    }
    nearest = nearest_names(name.removesuffix("Interface"), type_by_short_name)
    types = " or ".join(type_by_short_name[short_name] for short_name in nearest)
    return f" (did you mean {types}?)" if types else ""


def split_glob(glob: str) -> tuple[str, str]:
    """Return the patterns of type and id in ``TYPE::ID``; a missing pattern becomes ``*``."""
    type_glob, _, id_glob = glob.partition("::")
    return type_glob or "*", id_glob or "*"


def ask_daemon(url: str, verb: str, **arguments: Any) -> Any:
    """Send a request to a daemon and return the result; see :func:`cxbridge.daemon.client.request`."""
    from cxbridge.daemon.client import request

    with connect(url, None) as board:
        return request(board, verb, REPLY_TIMEOUT_S, **arguments)


def make_registry(interface_dirs: list[Path] | None) -> InterfaceRegistry | None:
    """Return a registry of the given folders and the shipped definitions.

    None without folders: the readers of recordings then use their own registry.
    """
    from cxbridge.interfaces.registry import InterfaceRegistry

    return InterfaceRegistry(interface_dirs) if interface_dirs else None


def print_notes(notes: list[str], file: Path) -> None:
    """Print the warnings about a readable file to stderr."""
    for note in notes:
        say(f"{file}: {note}", err=True)
