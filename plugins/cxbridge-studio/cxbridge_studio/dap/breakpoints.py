"""The breakpoints of a client, and their verification.

A client sets breakpoints in groups: the breakpoints of a file, the breakpoints on names, and the exception
filters. Each request replaces a whole group. A client may set breakpoints before the rules are loaded; they
are verified again when the rules are loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.live import LiveRun
from cxbridge_studio.dap.rule_lines import BreakpointLines, RulePosition
from cxbridge_studio.dap.stops import read_source
from cxbridge_studio.debugger.breakpoints import Breakpoint, check_hit_count, parse_breakpoint

# the exception filters that editors show to the user, each with its title and its breakpoint
FILTERS: Final = {
    "goal-failed": ("A goal fails", "goal:*:FINISHED:FAILED"),
    "action-failed": ("A plan-action fails", "action:*:FAILED"),
    "skill-failed": ("A skill fails", "skill:*:S_FAILED"),
}

_FUNCTIONS_GROUP: Final = "functions"
_FILTERS_GROUP: Final = "filters"


@dataclass(frozen=True, slots=True)
class _LineBreakpoint:
    """A breakpoint on a line, with the state that the client has received."""

    rule: str
    file: Path
    state: protocol.Breakpoint


class Breakpoints:
    """The breakpoints of a client. They may change during the run."""

    def __init__(self) -> None:
        self._last_number = 0
        self._breakpoint_groups: dict[str, dict[int, Breakpoint]] = {}
        self._line_breakpoints: dict[str, list[_LineBreakpoint]] = {}
        self._function_states: dict[int, protocol.Breakpoint] = {}
        self._run: LiveRun | None = None

    def attach(self, run: LiveRun) -> None:
        """Set all breakpoints on a run, and from now on each change of breakpoints."""
        self._run = run
        for group, breakpoints in self._breakpoint_groups.items():
            run.set_breakpoints(group, breakpoints)

    def _replace(self, group: str, breakpoints: dict[int, Breakpoint]) -> None:
        self._breakpoint_groups[group] = breakpoints
        if self._run is not None:
            self._run.set_breakpoints(group, breakpoints)

    def _take_number(self) -> int:
        self._last_number += 1
        return self._last_number

    # -- breakpoints on lines

    def set_line_breakpoints(self, arguments: protocol.SetBreakpointsArguments) -> list[protocol.Breakpoint]:
        """Replace the breakpoints of a file and return their states."""
        file, text = read_source(arguments.source)
        lines = BreakpointLines(text, includes_actions=self._run is None or self._run.can_stop_at_actions)
        breakpoints: dict[int, Breakpoint] = {}
        states: list[protocol.Breakpoint] = []
        line_breakpoints: list[_LineBreakpoint] = []
        for request in arguments.breakpoints:
            number = self._take_number()
            position = lines.find_position(request.line) if request.line > 0 else None
            problem = _find_problem(request, position)
            if position is None or problem:
                line = request.line if position is None else position.line
                states.append(protocol.Breakpoint(number, verified=False, message=problem, line=line))
                continue
            breakpoints[number] = position.breakpoint(
                request.condition, request.hit_condition, request.log_message
            )
            message = (
                f"within the right-hand side of rule {position.rule}"
                if position.is_at_action
                else f"before rule {position.rule} fires"
            )
            state = protocol.Breakpoint(number, verified=True, message=message, line=position.line)
            state = self._verify_line(_LineBreakpoint(position.rule, file, state))
            line_breakpoints.append(_LineBreakpoint(position.rule, file, state))
            states.append(state)
        self._line_breakpoints[str(file)] = line_breakpoints
        self._replace(f"file:{file}", breakpoints)
        return states

    def _verify_line(self, line_breakpoint: _LineBreakpoint) -> protocol.Breakpoint:
        """Return the state of a breakpoint; before rules are loaded, the text of its file decides."""
        if self._run is None or not self._run.is_loaded:
            return line_breakpoint.state
        reason = self._run.explain_no_stop(line_breakpoint.rule, line_breakpoint.file)
        if not reason:
            return line_breakpoint.state
        return protocol.Breakpoint(
            line_breakpoint.state.id, verified=False, message=reason, line=line_breakpoint.state.line
        )

    def update_states(self) -> list[protocol.Breakpoint]:
        """Return the breakpoints whose state the loaded rules have changed."""
        pairs = [
            (self._verify_line(line_breakpoint), line_breakpoint.state)
            for file_breakpoints in self._line_breakpoints.values()
            for line_breakpoint in file_breakpoints
        ]
        pairs += [
            (self._verify_name(number, tested_breakpoint), self._function_states[number])
            for number, tested_breakpoint in self._breakpoint_groups.get(_FUNCTIONS_GROUP, {}).items()
        ]
        return [state for state, previous in pairs if state.verified != previous.verified]

    # -- breakpoints on names

    def set_function_breakpoints(
        self, requested: Sequence[protocol.FunctionBreakpoint]
    ) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on goals, plan-actions, skills and rules, and return their states."""
        breakpoints: dict[int, Breakpoint] = {}
        self._function_states.clear()
        for function in requested:
            number = self._take_number()
            try:
                parsed_breakpoint = parse_breakpoint(function.name)
                check_hit_count(function.hit_condition)
            except CxbridgeError as error:
                self._function_states[number] = protocol.Breakpoint(
                    number, verified=False, message=str(error)
                )
                continue
            # as in `cxbridge run --break`, the name may include a condition and a hit count
            condition = function.condition or parsed_breakpoint.condition
            hits = function.hit_condition or parsed_breakpoint.hits
            breakpoints[number] = replace(parsed_breakpoint, condition=condition, hits=hits)
            self._function_states[number] = self._verify_name(number, breakpoints[number])
        self._replace(_FUNCTIONS_GROUP, breakpoints)
        return list(self._function_states.values())

    def _verify_name(self, number: int, tested_breakpoint: Breakpoint) -> protocol.Breakpoint:
        """Return the state of a breakpoint on a name, which is verified until the rules are loaded."""
        is_loaded = self._run is not None and self._run.is_loaded
        reason = self._run.explain_unreachable(tested_breakpoint) if self._run and is_loaded else ""
        return protocol.Breakpoint(number, verified=not reason, message=reason)

    def set_exception_filters(self, names: Sequence[str]) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on failures and return their states."""
        unknown_names = [name for name in names if name not in FILTERS]
        if unknown_names:
            raise CxbridgeError(
                f"there is no filter '{unknown_names[0]}'", hint=f"the filters are {', '.join(FILTERS)}"
            )
        breakpoints = {
            self._take_number(): parse_breakpoint(spec) for _, spec in map(FILTERS.__getitem__, names)
        }
        self._replace(_FILTERS_GROUP, breakpoints)
        return [protocol.Breakpoint(number, verified=True) for number in breakpoints]

    def is_exception_filter(self, number: int) -> bool:
        """Return whether a breakpoint belongs to an exception filter."""
        return number in self._breakpoint_groups.get(_FILTERS_GROUP, {})


def _find_problem(request: protocol.SourceBreakpoint, position: RulePosition | None) -> str:
    """Return why a breakpoint on a line is impossible; empty if it is possible."""
    if position is None:
        no_rule = "no rule begins at this line or below"
        return no_rule if request.line > 0 else "lines are counted from 1"
    try:
        check_hit_count(request.hit_condition)
    except CxbridgeError as error:
        return str(error)
    return ""
