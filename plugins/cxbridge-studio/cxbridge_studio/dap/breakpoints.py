"""The breakpoints of a client, and their verification.

A client sets breakpoints in groups: the breakpoints of a file, the breakpoints on names, and the exception
filters. Each request replaces a whole group. A client may set breakpoints before the rules are loaded; they
are verified again when the rules are loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from glob import escape
from itertools import starmap
from pathlib import Path
from typing import Any, Final, NamedTuple

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.debugged_run import DebuggedRun
from cxbridge_studio.dap.rule_lines import FileRule, find_rules, find_stop_line
from cxbridge_studio.dap.stops import read_source
from cxbridge_studio.debugger.breakpoints import ANY_NAME, Breakpoint, check_hit_condition, parse_breakpoint

# the exception filters that editors show to the user, each with its title and its breakpoint
FILTERS: Final = {
    "goal-failed": ("A goal fails", "goal:*:FINISHED:FAILED"),
    "action-failed": ("A plan-action fails", "action:*:FAILED"),
    "skill-failed": ("A skill fails", "skill:*:S_FAILED"),
}

_FILTERS_GROUP: Final = "filters"  # the name of a group, as are "names" and "file:PATH"


class _RequestedBreakpoint(NamedTuple):
    """A breakpoint that a client has requested.

    :param explain_no_stop: returns why no agent of a run can stop at the breakpoint; empty if an agent can.
    :param message: where the run stops, for the user; may be empty.
    :param line: the line of the breakpoint; 0 for a breakpoint that is not on a line.
    """

    breakpoint: Breakpoint
    explain_no_stop: Callable[[DebuggedRun], str]
    message: str = ""
    line: int = 0


class Breakpoints:
    """The breakpoints of a client. They may change during the run."""

    def __init__(self) -> None:
        self._last_number = 0
        # by group and the client's number
        self._groups: dict[str, dict[int, _RequestedBreakpoint]] = {}
        self._run: DebuggedRun | None = None

    def attach(self, run: DebuggedRun) -> None:
        """Set all breakpoints on a run, and from now on each change of breakpoints."""
        self._run = run
        for group in self._groups:
            self._set_on_run(group)

    def _set_on_run(self, group: str) -> None:
        if self._run is not None:
            self._run.set_breakpoints(
                group, {number: requested.breakpoint for number, requested in self._groups[group].items()}
            )

    def _replace(
        self, group: str, requests: Iterable[Any], make_breakpoint: Callable[[Any], _RequestedBreakpoint]
    ) -> list[protocol.Breakpoint]:
        """Replace the breakpoints of a group and return their states.

        :param make_breakpoint: returns the breakpoint for a request, or raises ``CxbridgeError``.
        """
        self._groups[group] = {}
        states = []
        for request in requests:
            self._last_number += 1
            try:
                requested_breakpoint = make_breakpoint(request)
                self._groups[group][self._last_number] = requested_breakpoint
                states.append(self._make_state(self._last_number, requested_breakpoint))
            except CxbridgeError as error:
                states.append(protocol.Breakpoint(self._last_number, verified=False, message=str(error)))
        self._set_on_run(group)
        return states

    def _make_state(self, number: int, requested: _RequestedBreakpoint) -> protocol.Breakpoint:
        """Return the state of a breakpoint, which counts as verified before the rules are loaded."""
        reason = requested.explain_no_stop(self._run) if self._run is not None and self._run.is_loaded else ""
        message = reason or requested.message
        return protocol.Breakpoint(number, verified=not reason, message=message, line=requested.line)

    def find_unreachable(self) -> list[protocol.Breakpoint]:
        """Return the states of the breakpoints that the loaded rules cannot reach."""
        numbered_breakpoints = [pair for group in self._groups.values() for pair in group.items()]
        return [state for state in starmap(self._make_state, numbered_breakpoints) if not state.verified]

    def set_line_breakpoints(self, arguments: protocol.SetBreakpointsArguments) -> list[protocol.Breakpoint]:
        """Replace the breakpoints of a file and return their states.

        :raises CxbridgeError: if the file cannot be read.
        """
        file, text = read_source(arguments.source)
        includes_actions = self._run is None or self._run.can_stop_at_actions
        make_breakpoint = partial(
            _make_line_breakpoint, file, list(find_rules(text)), includes_actions=includes_actions
        )
        return self._replace(f"file:{file}", arguments.breakpoints, make_breakpoint)

    def set_function_breakpoints(
        self, requests: Sequence[protocol.FunctionBreakpoint]
    ) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on goals, plan-actions, skills and rules, and return their states."""
        return self._replace("names", requests, _make_name_breakpoint)

    def set_exception_filters(self, names: Sequence[str]) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on failures and return their states.

        :param names: keys of :data:`FILTERS`.
        :raises CxbridgeError: if there is no such filter.
        """
        unknown_names = [name for name in names if name not in FILTERS]
        if unknown_names:
            raise CxbridgeError(
                f"there is no filter '{unknown_names[0]}'", hint=f"the filters are {', '.join(FILTERS)}"
            )
        specs = [spec for _, spec in map(FILTERS.__getitem__, names)]
        # failures may always occur
        return self._replace(
            _FILTERS_GROUP, specs, lambda spec: _RequestedBreakpoint(parse_breakpoint(spec), lambda _run: "")
        )

    def is_exception_filter(self, number: int) -> bool:
        """Return whether a breakpoint belongs to an exception filter."""
        return number in self._groups.get(_FILTERS_GROUP, {})


def _make_line_breakpoint(
    file: Path, rules: Sequence[FileRule], request: protocol.SourceBreakpoint, *, includes_actions: bool
) -> _RequestedBreakpoint:
    check_hit_condition(request.hit_condition)
    rule, action_line = find_stop_line(rules, request.line, includes_actions=includes_actions)
    kind, state = ("line", str(action_line)) if action_line else ("before", ANY_NAME)
    return _RequestedBreakpoint(
        Breakpoint(
            0,
            kind,
            escape(rule.name),  # the name of a breakpoint is a shell pattern
            state,
            condition=request.condition,
            hit_condition=request.hit_condition,
            log_message=request.log_message,
        ),
        lambda run: run.explain_no_stop(rule.name, file),
        f"within the right-hand side of rule {rule.name}"
        if action_line
        else f"before rule {rule.name} fires",
        action_line or rule.first_line,
    )


def _make_name_breakpoint(request: protocol.FunctionBreakpoint) -> _RequestedBreakpoint:
    parsed_breakpoint = parse_breakpoint(request.name)
    check_hit_condition(request.hit_condition)
    # as in `cxbridge run --break`, the name may include a condition, a hit count and a text to log
    requested_breakpoint = replace(
        parsed_breakpoint,
        condition=request.condition or parsed_breakpoint.condition,
        hit_condition=request.hit_condition or parsed_breakpoint.hit_condition,
    )
    return _RequestedBreakpoint(
        requested_breakpoint, lambda run: run.explain_unreachable(requested_breakpoint)
    )
