"""``cxbridge skill monitor`` on a terminal: draws the state of a Skiller again at each change."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.live import Live

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.errors import CxbridgeError
from cxbridge.interfaces.assignments import json_value
from cxbridge.printing import unfiltered_stream, visible
from cxbridge.skiller.calls import OWNER, SKILLER_TYPE
from cxbridge_studio.terminal.drawing import draw_skill, list_transitions
from cxbridge_studio.terminal.graphs import DEBUG_TYPE, OVERVIEWS, fetch_graph
from cxbridge_studio.terminal.machinegraph import parse_graph

_OVERVIEW_TIMEOUT_S = 2.0  # the time limit for the graph of dependencies, which is only an addition


def show_skiller(
    board: BlackBoard, skiller: str, count: int | None, deadline: Deadline, console: Console | None = None
) -> bool:
    """Draw the state of a Skiller at each change; return whether ``count`` changes occurred.

    :param console: the terminal; None for stdout.
    """
    uses = _fetch_uses(board, skiller)
    console = console or Console(file=unfiltered_stream(sys.stdout))
    with Feed(board, OWNER) as feed, Live(console=console, auto_refresh=False) as live:
        values = _read_values(feed.read_state(feed.open(SKILLER_TYPE, skiller)))
        graph = _read_graph(feed.read_state(feed.open(DEBUG_TYPE, skiller)))
        change_count = 0
        previous_value: object = None
        while True:
            if (values, graph) != previous_value:
                previous_value, change_count = (values, graph), change_count + 1
                live.update(draw_skill(values, graph, uses), refresh=True)
            if change_count == count:
                return True
            change = feed.wait_for_change(deadline)
            if change is None:
                return False
            if change.uid.startswith(f"{DEBUG_TYPE}::"):
                graph = _read_graph(change)
            else:
                values = _read_values(change)


def _read_values(change: InterfaceChange) -> dict[str, object]:
    if change.kind == "writer removed":
        return {}
    return {key: json_value(item) for key, item in change.values.items()}


def _read_graph(change: InterfaceChange) -> str:
    """Return the graph of a state machine; empty if a further viewer has requested an overview."""
    return "" if change.values["graph_fsm"] in OVERVIEWS else str(change.values["graph"])


def _fetch_uses(board: BlackBoard, skiller: str) -> dict[str, list[str]]:
    """Return the skills that each skill uses; empty if the Skiller does not report them."""
    try:
        graph = parse_graph(visible(fetch_graph(board, skiller, "SKILL_DEP", timeout_s=_OVERVIEW_TIMEOUT_S)))
    except CxbridgeError:
        return {}
    uses: dict[str, list[str]] = {}
    for transition in list_transitions(graph):
        uses.setdefault(transition.source, []).append(transition.target)
    return uses
