"""SkillerDebugInterface: the graph of the running state machine, for viewers such as skillgui.

A viewer selects the subject of the graph by a message: a skill, or one of the special subjects below.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.events import Logger
from cxbridge.skiller.lua.engine import LuaEngine

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

ACTIVE = "ACTIVE"
"""Selects the first skill that the active skill string calls."""
LIST = "LIST"
"""Selects the names of all skills, one per line."""
DEPENDENCIES = "SKILL_DEP"
"""Selects the dependencies of skills."""

_DIRECTIONS = {"GD_TOP_BOTTOM": "TB", "GD_BOTTOM_TOP": "BT", "GD_LEFT_RIGHT": "LR", "GD_RIGHT_LEFT": "RL"}


class SkillerDebugWriter:
    """Writes ``SkillerDebugInterface::NAME`` and its twin ``...Layouted``.

    Older versions of Fawkes wrote the laid-out graph to the twin. Here the twin gets the unchanged graph of
    each drawn state machine, and keeps the graph while the main interface has a list or no graph.

    :raises BlackBoardError: if an interface has another writer.
    """

    def __init__(self, board: BlackBoard, engine: LuaEngine, log: Logger, *, name: str, owner: str) -> None:
        self._board = board
        self._engine = engine
        self._log = log
        # the classes of the interfaces are made from XML at run time, so they have no static types
        self._main: Any = board.open_for_writing("SkillerDebugInterface", name, owner=owner)
        self._twin: Any = board.open_for_writing("SkillerDebugInterface", f"{name}Layouted", owner=owner)
        self._interfaces: tuple[Any, ...] = (self._main, self._twin)
        self._max_bytes = self._main.maxlenof("graph") - 1  # without the NUL at the end
        self._subject = ACTIVE
        self._direction = "TB"
        self._is_coloured = True
        self._needs_redraw = False
        self._has_started = False

    def loop(self) -> None:
        """Write the initial values in the first loop; then handle messages."""
        # in the first loop, as in Fawkes, where the skills are loaded before the first write
        if not self._has_started:
            self._has_started = True
            for interface in self._interfaces:
                interface.graph_colored = self._is_coloured
                interface.write()
        while not self._main.msgq_empty():
            self._process(self._main.msgq_first())
            self._main.msgq_pop()

    def _process(self, message: Any) -> None:
        if message.type == "SetGraphMessage":
            self._subject = message.graph_fsm
        elif message.type == "SetGraphDirectionMessage":
            # a number that is no direction, which any client may send, selects the default
            direction = getattr(message.graph_dir, "name", "GD_TOP_BOTTOM")
            self._needs_redraw |= self._direction != _DIRECTIONS[direction]
            self._direction = _DIRECTIONS[direction]
            self._main.graph_dir = direction
        elif message.type == "SetGraphColoredMessage":
            self._needs_redraw |= self._is_coloured != message.graph_colored
            self._is_coloured = self._main.graph_colored = message.graph_colored
        self.publish()

    def publish(self) -> None:
        """Write the graph if it has changed, or the list or dependencies of skills if newly selected."""
        is_new_subject = self._subject != self._main.graph_fsm
        if self._subject in (LIST, DEPENDENCIES):
            if is_new_subject:
                self._write(self._engine.overview(self._subject))
            return
        has_machine, graph = self._engine.draw_graph(
            "" if self._subject == ACTIVE else self._subject,
            self._direction,
            coloured=self._is_coloured,
            redraw=is_new_subject or self._needs_redraw,
        )
        if has_machine:
            self._publish_machine(graph)
        elif is_new_subject:
            if self._subject not in ("", ACTIVE):
                self._log.warn(f"Could not write FSM graph, FSM for {self._subject} not found")
            self._write("")
        elif self._needs_redraw:
            self._main.write()
        self._needs_redraw = False

    def _publish_machine(self, graph: str) -> None:
        """Write the graph of a state machine; an empty text stands for an unchanged graph."""
        if graph:
            size = len(graph.encode("utf-8", "surrogateescape"))
            # the field cuts the graph; viewers get the start, and the log says why
            if size > self._max_bytes:
                self._log.error(f"the graph exceeds its maximum size ({size} vs. {self._max_bytes})")
            self._write(graph)
            self._twin.graph = graph
            self._twin.write()

    def _write(self, graph: str) -> None:
        self._main.graph_fsm = self._subject
        self._main.graph = graph
        self._main.write()

    def close(self) -> None:
        """Close both interfaces."""
        for interface in self._interfaces:
            self._board.close(interface)
