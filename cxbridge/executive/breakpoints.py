"""Breakpoints: where the executive is to stop, and how that is written."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final

from cxbridge.errors import ExecutiveError
from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.history.transitions import Transition

_ANY: Final = "*"
_STATUS = re.compile(r"(.+):(S_[A-Z*?]+)", re.DOTALL)
_CONDITION = re.compile(r"\s+if\s+(?=\()")

_KINDS: Final = {"rule": "before", "before": "before", "after": "after"} | {
    kind: kind for kind in ("goal", "action", "skill")
}
_MOST_PARTS: Final = {"before": 1, "after": 1, "goal": 3, "action": 2}
_FORMS: Final = "rule:NAME, after:NAME, goal:NAME[:MODE[:OUTCOME]], action:NAME[:STATE], skill:SKILL[:STATUS]"


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """Where to stop. All but ``kind`` and ``condition`` are patterns of the shell.

    :param number: given when it is added; 0 before.
    :param kind: ``before`` or ``after`` a rule, at a ``goal``, an ``action`` or a ``skill``.
    :param name: the rule; id or class of the goal; the action; the skill string.
    :param state: the goal's mode, the action's state, the skill's status.
    :param outcome: of the goal.
    :param condition: a CLIPS expression that must not be FALSE; empty: always.
    """

    number: int
    kind: str
    name: str
    state: str = _ANY
    outcome: str = _ANY
    condition: str = ""

    @property
    def is_of_rules(self) -> bool:
        """Whether it stops at a rule rather than at what rules bring about."""
        return self.kind in ("before", "after")

    def has_rule(self, rule: str) -> bool:
        """Whether it names a rule; only of those that stop at rules."""
        return fnmatchcase(rule, self.name)

    def has_transition(self, event: Transition) -> bool:
        """Whether it stops at a transition."""
        if isinstance(event, GoalTransition):
            return (
                self.kind == "goal"
                and (fnmatchcase(event.goal, self.name) or fnmatchcase(event.goal_class, self.name))
                and fnmatchcase(event.mode, self.state)
                and fnmatchcase(event.outcome, self.outcome)
            )
        if isinstance(event, PlanActionTransition):
            return (
                self.kind == "action"
                and fnmatchcase(event.action, self.name)
                and fnmatchcase(event.state, self.state)
            )
        return (
            self.kind == "skill"
            and fnmatchcase(event.skill_string, self.name)
            and fnmatchcase(event.status, self.state)
        )

    def __str__(self) -> str:
        """Return it as :func:`parse_breakpoint` takes it."""
        parts = ["rule" if self.kind == "before" else self.kind, self.name]
        if self.outcome != _ANY:
            parts += [self.state, self.outcome]
        elif self.state != _ANY:
            parts.append(self.state)
        return ":".join(parts) + (f" if {self.condition}" if self.condition else "")


def parse_breakpoint(spec: str) -> Breakpoint:
    """Return the breakpoint that a text stands for; see docs/debugging.md.

    :raises ExecutiveError: when it stands for none.
    """
    place, *condition = _CONDITION.split(spec.strip(), maxsplit=1)
    kind, colon, rest = place.partition(":")
    known = _KINDS.get(kind)
    if known is None or not colon or not rest:
        raise ExecutiveError(
            f"'{spec}' is not a breakpoint", hint=f"use one of: {_FORMS}; each may end in: if (CLIPS)"
        )
    if known == "skill":
        # a skill string may have colons
        found = _STATUS.fullmatch(rest)
        parts = list(found.groups()) if found else [rest]
    else:
        parts = rest.split(":")
        if len(parts) > _MOST_PARTS[known]:
            raise ExecutiveError(
                f"'{spec}' has too many parts for a breakpoint", hint=f"use one of: {_FORMS}"
            )
    name, state, outcome = [part or _ANY for part in (*parts, "", "")][:3]
    return Breakpoint(0, known, name, state, outcome, condition[0] if condition else "")


@dataclass(frozen=True, slots=True)
class Stop:
    """The executive has stopped.

    :param kind: ``before``, ``after``, ``transition``, ``step`` or ``asked``.
    :param reason: why, for people.
    :param breakpoint: number of the breakpoint; 0: there is none.
    :param rule: what fired last in this loop; empty: nothing.
    :param next_rule: what fires next; empty: the agenda is empty.
    :param event: the transition, of one.
    :param loop: number of the loop, of those that the debugger has seen; from 1.
    :param fired: how many rules have fired in this loop.
    :param time_us: on the run's clock.
    """

    kind: str
    reason: str
    breakpoint: int
    rule: str
    next_rule: str
    event: Transition | None
    loop: int
    fired: int
    time_us: int

    def plain(self) -> dict[str, str | int]:
        """Return it as JSON can have it; without the event, which the reason has."""
        names = ("kind", "reason", "breakpoint", "rule", "next_rule", "loop", "fired", "time_us")
        return {name: getattr(self, name) for name in names}


def describe(event: Transition) -> str:
    """Return a transition for people, in one line."""
    if isinstance(event, GoalTransition):
        outcome = f" {event.outcome}" if event.outcome not in ("", "UNKNOWN") else ""
        error = f", error: {event.error}" if event.error else ""
        return f"goal {event.goal} ({event.goal_class}) is {event.mode}{outcome}{error}"
    if isinstance(event, PlanActionTransition):
        return f"action {event.action} ({event.goal}/{event.plan}/{event.action_id}) is {event.state}"
    return f"skill {event.skill_string or '(none)'} of {event.skiller} is {event.status}"
