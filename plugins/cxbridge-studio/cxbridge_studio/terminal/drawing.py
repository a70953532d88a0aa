"""Draws a running skill for the terminal: its state machine, the active state, the path to that state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cxbridge.errors import SkillerError
from cxbridge.printing import one_line, visible
from cxbridge_studio.terminal.machinegraph import MachineState, MachineTransition, StateMachine, parse_graph

_STATUS_STYLES = {"S_RUNNING": "yellow", "S_FINAL": "green", "S_FAILED": "red", "S_INACTIVE": "dim"}
_KIND_STYLES = {"start": "bold", "final": "green", "failed": "red", "end": "cyan"}
_ACTIVE, _VISITED, _UNVISITED = "\N{BLACK CIRCLE}", "\N{WHITE CIRCLE}", " "
_ARROW = "\N{RIGHTWARDS ARROW}"
_MAX_SHOWN_TRANSITIONS = 12  # limit of the last transitions in the line of a path


def draw_skill(values: Mapping[str, Any], graph: str, uses: Mapping[str, list[str]]) -> RenderableType:
    """Return the drawing of a running skill.

    :param values: the fields of SkillerInterface, enums by name; empty if the Skiller is gone.
    :param graph: the graph of SkillerDebugInterface; empty if there is none.
    :param uses: the skills that each skill uses, by name.
    """
    values = {name: one_line(value) if isinstance(value, str) else value for name, value in values.items()}
    graph = visible(graph)
    rows: list[RenderableType] = [_make_head_line(values)]
    if graph:
        try:
            machine = parse_graph(graph)
        except SkillerError as error:
            rows.append(Text(f"(not a state machine, or too big to be shown: {error.message})", style="dim"))
        else:
            rows += _make_machine_rows(machine, uses)
    return Group(*rows)


def _make_head_line(values: Mapping[str, Any]) -> Text:
    if not values:
        return Text("the Skiller is gone", style="red")
    status = values["status"]
    line = Text.assemble((f"{status} ", _STATUS_STYLES.get(status, "")), (values["skill_string"], "bold"))
    line.append(f"  #{values['msgid']}, control: {values['exclusive_controller'] or 'nobody'}", style="dim")
    if values["error"]:
        line.append(f"\n{values['error']}", style="red")
    return line


def _make_machine_rows(machine: StateMachine, uses: Mapping[str, list[str]]) -> list[RenderableType]:
    names = {state.node: state.name for _, inner in machine.walk() for state in inner.states}
    transitions = list_transitions(machine)
    title = Text.assemble("\n", (machine.name, "bold underline"))
    if uses.get(machine.name):
        title.append(f"  uses {', '.join(uses[machine.name])}", style="dim")
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    for depth, inner in machine.walk():
        visited = {
            node
            for transition in inner.taken_transitions()
            for node in (transition.source, transition.target)
        }
        if depth:
            table.add_row(Text(f"{'  ' * depth}{inner.name}", style="underline"), Text())
        for state in inner.states:
            # the transitions of all machines, since a transition may lead out of an inner machine
            exits = [transition for transition in transitions if transition.source == state.node]
            table.add_row(
                _make_state_text(state, depth, is_visited=state.node in visited),
                _make_exits_text(exits, names),
            )
    return [title, table, *_make_path_lines(machine, names)]


def list_transitions(machine: StateMachine) -> list[MachineTransition]:
    """Return the transitions of a machine and its inner machines."""
    return [transition for _, inner in machine.walk() for transition in inner.transitions]


def _make_state_text(state: MachineState, depth: int, *, is_visited: bool) -> Text:
    mark = _ACTIVE if state.is_active else _VISITED if is_visited else _UNVISITED
    style = "reverse bold" if state.is_active else _KIND_STYLES.get(state.kind, "" if is_visited else "dim")
    text = Text.assemble("  " * depth, f"{mark} ", (state.name, style))
    if state.note:
        text.append(f" ({state.note})", style="dim")
    return text


def _make_exits_text(transitions: list[MachineTransition], names: Mapping[str, str]) -> Text:
    lines = []
    for transition in transitions:
        target = names.get(transition.target, transition.target)
        steps = f" [{','.join(map(str, transition.steps))}]" if transition.steps else ""
        label = f"  {transition.label}" if transition.label else ""
        lines.append(Text(f"{_ARROW} {target}{steps}{label}", style="yellow" if transition.steps else "dim"))
    return Text("\n").join(lines)


def _make_path_lines(machine: StateMachine, names: Mapping[str, str]) -> list[RenderableType]:
    """Return a line for each machine with the last transitions of its path."""
    lines: list[RenderableType] = []
    for _, inner in machine.walk():
        path_transitions = inner.taken_transitions()
        if path_transitions:
            shown_transitions = path_transitions[-_MAX_SHOWN_TRANSITIONS:]
            nodes = [shown_transitions[0].source, *(transition.target for transition in shown_transitions)]
            ellipsis = "... " if len(path_transitions) > _MAX_SHOWN_TRANSITIONS else ""
            path = f" {_ARROW} ".join(names.get(node, node) for node in nodes)
            lines.append(Text(f"path: {ellipsis}{path}", style="yellow"))
    return lines
