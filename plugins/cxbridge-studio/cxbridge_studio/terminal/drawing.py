"""The display of a running skill on the terminal: its machine, the current state, the path to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cxbridge.errors import SkillerError
from cxbridge.printing import one_line, visible
from cxbridge_studio.terminal.machinegraph import MachineState, MachineTransition, StateMachine, parse_graph

_COLOURS = {"S_RUNNING": "yellow", "S_FINAL": "green", "S_FAILED": "red", "S_INACTIVE": "dim"}
_KINDS = {"start": "bold", "final": "green", "failed": "red", "end": "cyan"}
_HERE, _BEEN, _NOT_YET = "\N{BLACK CIRCLE}", "\N{WHITE CIRCLE}", " "
_ARROW = "\N{RIGHTWARDS ARROW}"
_MAX_WAY = 12  # states of the way that fit into a line


def view(values: Mapping[str, Any], graph: str, uses: Mapping[str, list[str]]) -> RenderableType:
    """Return the display of a skill.

    :param values: the fields of SkillerInterface, enums by name; empty if the Skiller has gone.
    :param graph: the graph of SkillerDebugInterface; empty without one.
    :param uses: the used skills of each skill.
    """
    values = {name: one_line(value) if isinstance(value, str) else value for name, value in values.items()}
    graph = visible(graph)
    parts: list[RenderableType] = [_head(values)]
    if graph:
        try:
            machine = parse_graph(graph)
        except SkillerError as error:
            parts.append(Text(f"(not a state machine, or too big to be shown: {error.message})", style="dim"))
        else:
            parts += _machine(machine, uses)
    return Group(*parts)


def _head(values: Mapping[str, Any]) -> Text:
    if not values:
        return Text("the Skiller is gone", style="red")
    status = values["status"]
    line = Text.assemble((f"{status} ", _COLOURS.get(status, "")), (values["skill_string"], "bold"))
    line.append(f"  #{values['msgid']}, control: {values['exclusive_controller'] or 'nobody'}", style="dim")
    if values["error"]:
        line.append(f"\n{values['error']}", style="red")
    return line


def _machine(machine: StateMachine, uses: Mapping[str, list[str]]) -> list[RenderableType]:
    names = {state.node: state.name for _, part in machine.walk() for state in part.states}
    title = Text.assemble("\n", (machine.name, "bold underline"))
    if uses.get(machine.name):
        title.append(f"  uses {', '.join(uses[machine.name])}", style="dim")
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    for depth, part in machine.walk():
        been = {end for item in part.way() for end in (item.source, item.target)}
        if depth:
            table.add_row(Text(f"{'  ' * depth}{part.name}", style="underline"), Text())
        for state in part.states:
            table.add_row(
                _state(state, depth, been=state.node in been),
                _exits([item for item in machine_transitions(machine) if item.source == state.node], names),
            )
    return [title, table, *_way(machine, names)]


def machine_transitions(machine: StateMachine) -> list[MachineTransition]:
    """Return the transitions of a machine and its inner machines."""
    return [item for _, part in machine.walk() for item in part.transitions]


def _state(state: MachineState, depth: int, *, been: bool) -> Text:
    mark = _HERE if state.active else _BEEN if been else _NOT_YET
    style = "reverse bold" if state.active else _KINDS.get(state.kind, "" if been else "dim")
    text = Text.assemble("  " * depth, f"{mark} ", (state.name, style))
    if state.note:
        text.append(f" ({state.note})", style="dim")
    return text


def _exits(transitions: list[MachineTransition], names: Mapping[str, str]) -> Text:
    lines = []
    for item in transitions:
        target = names.get(item.target, item.target)
        taken = f" [{','.join(map(str, item.steps))}]" if item.steps else ""
        label = f"  {item.label}" if item.label else ""
        lines.append(Text(f"{_ARROW} {target}{taken}{label}", style="yellow" if item.steps else "dim"))
    return Text("\n").join(lines)


def _way(machine: StateMachine, names: Mapping[str, str]) -> list[RenderableType]:
    """Return a line with the last steps of each machine's path."""
    lines: list[RenderableType] = []
    for _, part in machine.walk():
        way = part.way()
        if way:
            shown = way[-_MAX_WAY:]
            first = names.get(shown[0].source, shown[0].source)
            line = Text(f"way: {'... ' if len(way) > _MAX_WAY else ''}{first}", style="yellow")
            for item in shown:
                line.append(f" {_ARROW} {names.get(item.target, item.target)}")
            lines.append(line)
    return lines
