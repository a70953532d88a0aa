"""Makes graphs of skills in the dot language, from a running Skiller or from skill files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.clock import VirtualClock
from cxbridge.errors import SkillerError
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.calls import OWNER

DEBUG_TYPE = "SkillerDebugInterface"
DEPENDENCIES = "SKILL_DEP"  # the subject of the graph of the dependencies between skills
_DIRECTION = "TB"  # of the edges, in the dot language: from top to bottom


def fetch_graph(board: BlackBoard, skiller: str, subject: str, timeout_s: float = 5.0) -> str:
    """Fetch a graph in the dot language from a Skiller, and restore the graph that it showed before.

    SkillerDebugInterface has one field for a graph, so all viewers of a Skiller see the same graph.

    :param subject: a skill, ``ACTIVE``, or :data:`DEPENDENCIES`.
    :raises SkillerError: if the Skiller or skill does not exist, the subject is too long, or the Skiller does
        not reply in time.
    """
    with Feed(board, OWNER) as feed:
        interface = feed.open(DEBUG_TYPE, skiller)
        if not interface.has_writer:
            raise SkillerError(f"no Skiller writes {DEBUG_TYPE}::{skiller}", hint="see 'cxbridge skill list'")
        max_bytes = interface.maxlenof("graph_fsm") - 1  # without the final NUL
        if len(subject.encode("utf-8", "surrogateescape")) > max_bytes:
            raise SkillerError(f"'{subject}' is longer than the {max_bytes} bytes that its field has")
        previous_subject = feed.read_state(interface).values["graph_fsm"]
        try:
            _request_graph(interface, subject)
            change = _wait_for_graph(feed, interface, subject, Deadline(timeout_s))
        finally:
            # before the first request for a graph, a Skiller shows the active skill
            _request_graph(interface, previous_subject or "ACTIVE")
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


def _request_graph(interface: Interface, subject: str) -> None:
    message = interface.create_message("SetGraphMessage")
    message.set("graph_fsm", subject)
    interface.msgq_enqueue(message)


def _wait_for_graph(
    feed: Feed, interface: Interface, subject: str, deadline: Deadline
) -> InterfaceChange | None:
    """Return the first change with the graph of a subject; None after the deadline."""
    change: InterfaceChange | None = feed.read_state(interface)
    while change is not None and change.values["graph_fsm"] != subject:
        change = feed.wait_for_change(deadline)
    return change


def make_graph(
    subject: str, folders: Sequence[Path], interface_dirs: Sequence[Path] = (), *, space: str = "test"
) -> str:
    """Make a graph in the dot language from skill files, as a Skiller would after loading them.

    :param subject: a skill, or :data:`DEPENDENCIES`.
    :param folders: see :func:`cxbridge.skiller.make.skill_folders`.
    :param space: the skill space, whose skills are loaded.
    :raises SkillerError: if the skill does not exist, or has no state machine.
    :raises CxbridgeError: if the skills cannot be loaded.
    """
    from cxbridge.skiller.make import make_lua_skiller  # noqa: PLC0415 - loads Lua

    clock = VirtualClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(interface_dirs), clock, bus)
    with make_lua_skiller(board, clock, bus, folders=folders, space=space) as skiller:
        if subject == DEPENDENCIES:
            return skiller.engine.overview(subject)
        exists, graph = skiller.engine.draw_graph(subject, _DIRECTION, coloured=True, redraw=True)
        if not exists:
            is_skill = subject in skiller.skills
            raise SkillerError(
                f"in the skill space '{space}', skill '{subject}' has no state machine"
                if is_skill
                else f"there is no skill '{subject}' in the skill space '{space}'",
                hint=f"its skills are: {', '.join(sorted(skiller.skills))}",
            )
        return graph
