"""Breakpoints on lines of CLIPS files: the rule, or the action of one, that a line stands for."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from glob import escape

from cxbridge.executive.breakpoints import Breakpoint
from cxbridge_studio.dap.actions import FileRule, rules_of


@dataclass(frozen=True, slots=True)
class LinePlace:
    """Where a breakpoint on a line stops.

    :param line: its line, moved if it has no place to stop at.
    :param action: whether it stops at an action of the rule, and not before the rule.
    """

    rule: str
    line: int
    action: bool

    def breakpoint(self, condition: str = "", hits: str = "", log: str = "") -> Breakpoint:
        """Return the breakpoint that stops there."""
        kind, state = ("line", str(self.line)) if self.action else ("before", "*")
        return Breakpoint(0, kind, escape(self.rule), state, "*", condition, hits, log)


class FileLines:
    """The lines of a file that one can stop at.

    :param text: the file.
    :param actions: whether the actions of rules are among them.
    """

    def __init__(self, text: str, *, actions: bool) -> None:
        self._rules: list[FileRule] = list(rules_of(text))
        self._firsts = [rule.first for rule in self._rules]
        self._actions = actions

    def at(self, line: int) -> LinePlace | None:
        """Return the place of a line; of a line in no rule the next rule, None when none follows."""
        number = bisect_right(self._firsts, line) - 1
        if number < 0 or line > self._rules[number].last:
            number += 1
        if number >= len(self._rules):
            return None
        rule = self._rules[number]
        lines = [action.line for action in rule.actions] if self._actions else []
        if lines and line >= min(lines):
            return LinePlace(rule.name, max(each for each in lines if each <= line), action=True)
        return LinePlace(rule.name, rule.first, action=False)

    def between(self, first: int, last: int) -> list[int]:
        """Return the lines of a range that one can stop at."""
        found = {rule.first for rule in self._rules}
        if self._actions:
            found |= {action.line for rule in self._rules for action in rule.actions}
        return sorted(line for line in found if first <= line <= last)
