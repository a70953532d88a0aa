"""SkillerDebugInterface: the graph of the running state machine, for viewers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.events import Logger
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.lua.engine import LuaEngine

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

ACTIVE = "ACTIVE"
"""Show whatever skill was called first."""
LIST = "LIST"
"""Show the names of all skills, one a line."""
DEPENDENCIES = "SKILL_DEP"
"""Show which skill uses which."""

_DIRECTIONS = {"GD_TOP_BOTTOM": "TB", "GD_BOTTOM_TOP": "BT", "GD_LEFT_RIGHT": "LR", "GD_RIGHT_LEFT": "RL"}


class DebugBoard:
    """Writes ``SkillerDebugInterface::NAME`` and its twin ``...Layouted``.

    Fawkes once laid the graph out for the twin; nowadays both hold the same text there, too.

    :param name: of the Skiller.
    :param mode: ``fawkes`` writes the twin again in every loop of a running skill, as Fawkes does.
    :param owner: who opens the interfaces.
    """

    def __init__(
        self, board: BlackBoard, engine: LuaEngine, log: Logger, *, name: str, mode: Mode, owner: str
    ) -> None:
        self._board = board
        self._engine = engine
        self._log = log
        self._mode = mode
        # The fields of the interfaces come from their XML definition: there is no static type for them here.
        self._main: Any = board.open_for_writing("SkillerDebugInterface", name, owner=owner)
        self._twin: Any = board.open_for_writing("SkillerDebugInterface", f"{name}Layouted", owner=owner)
        self._both: tuple[Any, ...] = (self._main, self._twin)
        self._room = self._main.maxlenof("graph") - 1
        self._what = ACTIVE
        self._direction = "TB"
        self._coloured = True
        self._redraw = False
        self._started = False

    def loop(self) -> None:
        """Write the first values in the first loop; then do what messages ask for."""
        if not self._started:
            self._started = True
            for interface in self._both:
                interface.graph_colored = self._coloured
                interface.write()
        while not self._main.msgq_empty():
            self._process(self._main.msgq_first())
            self._main.msgq_pop()

    def _process(self, message: Any) -> None:
        if message.type == "SetGraphMessage":
            self._what = message.graph_fsm
        elif message.type == "SetGraphDirectionMessage":
            direction = getattr(message.graph_dir, "name", "GD_TOP_BOTTOM")
            self._redraw |= self._direction != _DIRECTIONS[direction]
            self._direction = _DIRECTIONS[direction]
            self._main.graph_dir = direction
        elif message.type == "SetGraphColoredMessage":
            self._redraw |= self._coloured != message.graph_colored
            self._coloured = self._main.graph_colored = message.graph_colored
        self.publish()

    def publish(self) -> None:
        """Write the graph if it is another one."""
        is_new = self._what != self._main.graph_fsm
        if self._what in (LIST, DEPENDENCIES):
            if is_new:
                self._write(self._engine.overview(self._what))
            return
        found, graph = self._engine.graph(
            "" if self._what == ACTIVE else self._what,
            self._direction,
            coloured=self._coloured,
            always=is_new or self._redraw,
        )
        if found:
            self._publish_machine(graph)
        elif is_new:
            if self._what not in ("", ACTIVE):
                self._log.warn(f"Could not write FSM graph, FSM for {self._what} not found")
            self._write("")
        elif self._redraw:
            self._main.write()
        self._redraw = False

    def _publish_machine(self, graph: str) -> None:
        if graph:
            size = len(graph.encode("utf-8", "surrogateescape"))
            if size > self._room:
                self._log.error(f"the graph exceeds its maximum size ({size} vs. {self._room})")
            self._write(graph)
            self._twin.graph = graph
            self._twin.write()
        elif self._mode == "fawkes":
            self._twin.mark_data_refreshed()
            self._twin.write()

    def _write(self, graph: str) -> None:
        self._main.graph_fsm = self._what
        self._main.graph = graph
        self._main.write()

    def close(self) -> None:
        """Close both interfaces."""
        for interface in self._both:
            self._board.close(interface)
