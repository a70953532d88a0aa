"""Makes graphs of skills in the dot language, from a running Skiller or skill files, and pictures of them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError, SkillerError
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.calls import OWNER

DEBUG_TYPE = "SkillerDebugInterface"
# the directions of graphs, with their names in the interface
DIRECTIONS = {"TB": "GD_TOP_BOTTOM", "BT": "GD_BOTTOM_TOP", "LR": "GD_LEFT_RIGHT", "RL": "GD_RIGHT_LEFT"}
# subjects that are not skills: the names of all skills, and the dependencies between skills
OVERVIEWS = ("LIST", "SKILL_DEP")
PICTURE_SUFFIXES = (".svg", ".png", ".pdf")  # the suffixes that `render_graph` supports

_RENDER_TIMEOUT_S = 60  # the time limit of graphviz, which may hang or get a huge graph


def fetch_graph(
    board: BlackBoard,
    skiller: str,
    subject: str,
    *,
    direction: str | None = None,
    coloured: bool | None = None,
    timeout_s: float = 5.0,
) -> str:
    """Fetch a graph in the dot language from a Skiller, and restore the graph that it showed before.

    SkillerDebugInterface has one field for a graph, so all viewers of a Skiller see the same graph.

    :param subject: a skill, ``ACTIVE``, or one of :data:`OVERVIEWS`.
    :param direction: one of :data:`DIRECTIONS`; None leaves the direction unchanged.
    :param coloured: whether the graph has colours; None leaves the setting unchanged.
    :raises SkillerError: if the Skiller or skill does not exist, or does not reply.
    """
    with Feed(board, OWNER) as feed:
        interface = feed.open(DEBUG_TYPE, skiller)
        if not interface.has_writer:
            raise SkillerError(f"no Skiller writes {DEBUG_TYPE}::{skiller}", hint="see 'cxbridge skill list'")
        max_bytes = interface.maxlenof("graph_fsm") - 1
        if len(subject.encode("utf-8", "surrogateescape")) > max_bytes:
            raise SkillerError(f"'{subject}' is longer than the {max_bytes} bytes that its field has")
        previous_values = feed.read_state(interface).values
        message_fields: dict[str, Any] = {"graph_fsm": subject}
        if subject not in OVERVIEWS:
            message_fields |= {} if direction is None else {"graph_dir": DIRECTIONS[direction]}
            message_fields |= {} if coloured is None else {"graph_colored": coloured}
        try:
            _request_graph(interface, message_fields)
            change = _wait_for_graph(feed, interface, message_fields, Deadline(timeout_s))
        finally:
            # the graph last, so that it is drawn only once, with its own direction and colours
            previous_fields = {
                name: _get_enum_name(previous_values[name]) for name in reversed(message_fields)
            }
            # a Skiller that nobody has asked for a graph shows the active skill
            previous_fields["graph_fsm"] = previous_fields["graph_fsm"] or "ACTIVE"
            _request_graph(interface, previous_fields)
    if change is None:
        raise SkillerError(
            f"the Skiller did not show '{subject}' within {timeout_s:g} s", hint="is it stopped?"
        )
    graph = str(change.values["graph"])
    if not graph:
        raise SkillerError(
            f"the Skiller has no graph of '{subject}'", hint="'cxbridge skill list' shows the skills it knows"
        )
    return graph


def _get_enum_name(value: Any) -> Any:
    """Return the name of an enum item; return any other value unchanged."""
    return getattr(value, "name", value)


def _request_graph(interface: Interface, message_fields: dict[str, Any]) -> None:
    """Send the messages that select the graph."""
    message_types = {
        "graph_fsm": "SetGraph",
        "graph_dir": "SetGraphDirection",
        "graph_colored": "SetGraphColored",
    }
    for name, value in message_fields.items():
        message = interface.create_message(f"{message_types[name]}Message")
        message.set(name, value)
        interface.msgq_enqueue(message)


def _wait_for_graph(
    feed: Feed, interface: Interface, expected_fields: dict[str, Any], deadline: Deadline
) -> InterfaceChange | None:
    """Return the first change with these fields; None after the deadline."""
    change: InterfaceChange | None = feed.read_state(interface)
    while change is not None and any(
        _get_enum_name(change.values[name]) != value for name, value in expected_fields.items()
    ):
        change = feed.wait_for_change(deadline)
    return change


def make_graph(
    subject: str,
    folders: Sequence[Path],
    interface_dirs: Sequence[Path] = (),
    *,
    space: str = "test",
    direction: str = "TB",
    coloured: bool = True,
) -> str:
    """Make a graph in the dot language from skill files, as a Skiller would after loading them.

    :param subject: a skill, or ``SKILL_DEP``.
    :param folders: see :func:`cxbridge.skiller.make.skill_folders`.
    :raises SkillerError: if the skill does not exist.
    :raises CxbridgeError: if the skills cannot be loaded.
    """
    from cxbridge.skiller.make import make_lua_skiller  # noqa: PLC0415 - loads Lua

    clock = VirtualClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(interface_dirs), clock, bus)
    with make_lua_skiller(board, clock, bus, folders=folders, space=space) as skiller:
        if subject in OVERVIEWS:
            return skiller.engine.overview(subject)
        skill, graph = skiller.engine.draw_graph(subject, direction, coloured=coloured, redraw=True)
        if not skill:
            is_skill = subject in skiller.skills
            raise SkillerError(
                f"skill '{subject}' has no state machine"
                if is_skill
                else f"there is no skill '{subject}' in the skill space '{space}'",
                hint=f"its skills are: {', '.join(sorted(skiller.skills))}",
            )
        return graph


def render_graph(graph: str, suffix: str) -> bytes:
    """Render a graph in the dot language as a picture.

    :param suffix: one of :data:`PICTURE_SUFFIXES`.
    :raises CxbridgeError: if graphviz is not installed.
    """
    program = shutil.which("dot")
    if program is None:
        raise CxbridgeError(
            "graphviz is not installed: its program 'dot' is needed for pictures",
            hint="install it, for example with 'apt install graphviz' or 'brew install graphviz', "
            "or write the graph itself with -o FILE.dot",
        )
    try:
        process = subprocess.run(  # noqa: S603 - a fixed program; the graph goes to its standard input
            [program, f"-T{suffix.removeprefix('.')}"],
            input=graph.encode(),
            capture_output=True,
            timeout=_RENDER_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise CxbridgeError(f"graphviz did not finish within {_RENDER_TIMEOUT_S} s") from None
    if process.returncode:
        reason = process.stderr.decode(errors="replace").strip().partition("\n")[0]
        raise CxbridgeError(f"graphviz cannot draw this graph: {reason}")
    return process.stdout
