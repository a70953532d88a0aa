"""The breakpoints of a client, and their verification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.breakpoint_lines import FileLines
from cxbridge_studio.dap.stops import Sources
from cxbridge_studio.dap.target import Target
from cxbridge_studio.debugger.breakpoints import Breakpoint, check_hits, parse_breakpoint

# The exception filters that editors offer: title and breakpoint.
FILTERS: Final = {
    "goal-failed": ("A goal fails", "goal:*:FINISHED:FAILED"),
    "action-failed": ("A plan-action fails", "action:*:FAILED"),
    "skill-failed": ("A skill fails", "skill:*:S_FAILED"),
}

_FUNCTIONS: Final = "functions"
_FILTERS: Final = "filters"


@dataclass(frozen=True, slots=True)
class _OnLine:
    rule: str
    file: Path
    shown: protocol.Breakpoint


class Breakpoints:
    """The breakpoints of a client. They may change while the target runs."""

    def __init__(self, sources: Sources) -> None:
        self._sources = sources
        self._last = 0
        self._groups: dict[str, dict[int, Breakpoint]] = {}
        self._on_lines: dict[str, list[_OnLine]] = {}
        self._functions: dict[int, protocol.Breakpoint] = {}
        self._target: Target | None = None

    def attach(self, target: Target) -> None:
        self._target = target
        for group, breakpoints in self._groups.items():
            target.set_breakpoints(group, breakpoints)

    def _put(self, group: str, breakpoints: dict[int, Breakpoint]) -> None:
        self._groups[group] = breakpoints
        if self._target is not None:
            self._target.set_breakpoints(group, breakpoints)

    def _next(self) -> int:
        self._last += 1
        return self._last

    # -- breakpoints on lines

    def set_lines(self, arguments: protocol.SetBreakpointsArguments) -> list[protocol.Breakpoint]:
        """Replace the breakpoints of a file and return their states."""
        file, text = self._sources.named(arguments.source)
        actions = self._target is None or self._target.can_stop_at_actions
        lines = FileLines(text, actions=actions)
        breakpoints: dict[int, Breakpoint] = {}
        answers: list[protocol.Breakpoint] = []
        on_lines: list[_OnLine] = []
        for line_breakpoint in arguments.wanted:
            number = self._next()
            place = lines.at(line_breakpoint.line) if line_breakpoint.line > 0 else None
            if place is None:
                below = "no rule begins at this line or below"
                message = below if line_breakpoint.line > 0 else "lines are counted from 1"
                answers.append(
                    protocol.Breakpoint(number, verified=False, message=message, line=line_breakpoint.line)
                )
                continue
            try:
                check_hits(line_breakpoint.hit_condition)
            except CxbridgeError as error:
                answers.append(
                    protocol.Breakpoint(number, verified=False, message=str(error), line=place.line)
                )
                continue
            breakpoints[number] = place.breakpoint(
                line_breakpoint.condition, line_breakpoint.hit_condition, line_breakpoint.log_message
            )
            shown = protocol.Breakpoint(
                number, verified=True, message=_where(place.rule, action=place.action), line=place.line
            )
            shown = self._checked(_OnLine(place.rule, file, shown))
            on_lines.append(_OnLine(place.rule, file, shown))
            answers.append(shown)
        self._on_lines[str(file)] = on_lines
        self._put(f"file:{file}", breakpoints)
        return answers

    def _checked(self, item: _OnLine) -> protocol.Breakpoint:
        """Return the state of a breakpoint, as far as the rules are known."""
        if self._target is None or not self._target.is_loaded:
            return item.shown
        reason = self._target.why_no_stop(item.rule, item.file)
        if not reason:
            return item.shown
        return protocol.Breakpoint(item.shown.id, verified=False, message=reason, line=item.shown.line)

    def check(self) -> list[protocol.Breakpoint]:
        """Return the breakpoints whose state has changed since the rules are loaded."""
        pairs = [(self._checked(item), item.shown) for items in self._on_lines.values() for item in items]
        pairs += [
            (self._reachable(number, item), self._functions[number])
            for number, item in self._groups.get(_FUNCTIONS, {}).items()
        ]
        return [now for now, previous in pairs if now.verified != previous.verified]

    def lines_between(self, arguments: protocol.BreakpointLocationsArguments) -> list[int]:
        """Return the lines of a range where a breakpoint is possible."""
        _, text = self._sources.named(arguments.source)
        actions = self._target is None or self._target.can_stop_at_actions
        lines = FileLines(text, actions=actions)
        return lines.between(arguments.line, arguments.end_line or arguments.line)

    # -- breakpoints on names

    def set_functions(self, wanted: Sequence[protocol.FunctionBreakpoint]) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on goals, plan-actions, skills and rules, and return their states."""
        breakpoints: dict[int, Breakpoint] = {}
        self._functions.clear()
        for each in wanted:
            number = self._next()
            try:
                item = parse_breakpoint(each.name)
                check_hits(each.hit_condition)
            except CxbridgeError as error:
                self._functions[number] = protocol.Breakpoint(number, verified=False, message=str(error))
                continue
            breakpoints[number] = replace(
                item,
                condition=each.condition or item.condition,
                hits=each.hit_condition or item.hits,
            )
            self._functions[number] = self._reachable(number, breakpoints[number])
        self._put(_FUNCTIONS, breakpoints)
        return list(self._functions.values())

    def _reachable(self, number: int, item: Breakpoint) -> protocol.Breakpoint:
        """Return the state of a named breakpoint, as far as names are known."""
        reason = ""
        if self._target is not None and self._target.is_loaded:
            reason = self._target.why_unreachable(item)
        return protocol.Breakpoint(number, verified=not reason, message=reason)

    def set_filters(self, wanted: protocol.SetExceptionBreakpointsArguments) -> list[protocol.Breakpoint]:
        """Replace the breakpoints on failures and return their states."""
        if wanted.exception_options or any(each.condition for each in wanted.filter_options):
            raise CxbridgeError("exception filters have no conditions and options here")
        names = [*wanted.filters, *(each.filter_id for each in wanted.filter_options)]
        unknown = [name for name in names if name not in FILTERS]
        if unknown:
            raise CxbridgeError(f"there is no filter '{unknown[0]}'", hint=f"there are: {', '.join(FILTERS)}")
        breakpoints = {self._next(): parse_breakpoint(FILTERS[name][1]) for name in names}
        self._put(_FILTERS, breakpoints)
        return [protocol.Breakpoint(number, verified=True) for number in breakpoints]

    def is_filter(self, number: int) -> bool:
        """Return whether a breakpoint belongs to an exception filter."""
        return number in self._groups.get(_FILTERS, {})


def _where(rule: str, *, action: bool) -> str:
    return f"within the right-hand side of rule {rule}" if action else f"before rule {rule} fires"
