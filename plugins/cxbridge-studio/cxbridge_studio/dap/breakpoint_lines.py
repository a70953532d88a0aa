"""Breakpoints on lines of CLIPS files: the rule or action of each line."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from glob import escape

from cxbridge_studio.dap.actions import FileRule, rules_of
from cxbridge_studio.debugger.breakpoints import Breakpoint


@dataclass(frozen=True, slots=True)
class RulePosition:
    """The position of a breakpoint on a line.

    :param line: the line, moved to the next possible position.
    :param action: whether to stop at an action of the rule instead of before the rule.
    """

    rule: str
    line: int
    action: bool

    def breakpoint(self, condition: str = "", hits: str = "", log: str = "") -> Breakpoint:
        kind, state = ("line", str(self.line)) if self.action else ("before", "*")
        return Breakpoint(0, kind, escape(self.rule), state, "*", condition, hits, log)


class FileLines:
    """The lines of a file where a breakpoint is possible.

    :param actions: whether the lines of actions are possible.
    """

    def __init__(self, text: str, *, actions: bool) -> None:
        self._rules: list[FileRule] = list(rules_of(text))
        self._firsts = [rule.first for rule in self._rules]
        self._actions = actions

    def at(self, line: int) -> RulePosition | None:
        """Return the position for a line; outside a rule, that of the next rule; None after the last rule."""
        number = bisect_right(self._firsts, line) - 1
        if number < 0 or line > self._rules[number].last:
            number += 1
        if number >= len(self._rules):
            return None
        rule = self._rules[number]
        lines = [action.line for action in rule.actions] if self._actions else []
        if lines and line >= min(lines):
            return RulePosition(rule.name, max(each for each in lines if each <= line), action=True)
        return RulePosition(rule.name, rule.first, action=False)

    def between(self, first: int, last: int) -> list[int]:
        """Return the possible lines in a range."""
        first_lines = {rule.first for rule in self._rules}
        if self._actions:
            first_lines |= {action.line for rule in self._rules for action in rule.actions}
        return sorted(line for line in first_lines if first <= line <= last)
