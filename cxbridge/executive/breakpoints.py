"""Breakpoints: where the executive is to stop, and how that is written."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final

from cxbridge.errors import ExecutiveError
from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.history.transitions import Transition

ANY: Final = "*"
"""The value of a part of a breakpoint that was left out."""

LONGEST = 4096
"""Characters of a breakpoint: clients of a daemon set breakpoints, too."""

_STATUS = re.compile(r"(.+):(S_[A-Z*?]+)", re.DOTALL)
_CONDITION = re.compile(r"\s+if\s+(?=\()")
_HITS = re.compile(r"\s+hit\s+(\S+)\Z")
_LOG = re.compile(r'\s+log\s+"(.*)"\Z', re.DOTALL)
_ARGUMENTS = re.compile(r"[\s({]")
_EXPRESSION = re.compile(r"\{([^{}]*)\}")
_COUNT = re.compile(r"(<=|>=|==|=|<|>|%)?\s*(\d{1,9})")
_COMPARED: Final[Mapping[str, Callable[[int, int], bool]]] = {
    "=": operator.eq,
    "==": operator.eq,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "%": lambda reached, number: reached % number == 0,
}

_KINDS: Final = {"rule": "before", "before": "before", "after": "after"} | {
    kind: kind for kind in ("goal", "action", "skill")
}
_MOST_PARTS: Final = {"before": 1, "after": 1, "goal": 3, "action": 2}
_FORMS: Final = "rule:NAME, after:NAME, goal:NAME[:MODE[:OUTCOME]], action:NAME[:STATE], skill:SKILL[:STATUS]"


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """Where to stop. ``name``, ``state`` and ``outcome`` are patterns of the shell.

    :param number: given when it is added; 0 before.
    :param kind: ``before`` or ``after`` a rule, at a ``goal``, an ``action`` or a ``skill``; at a ``line`` of
        a rule's right-hand side, see :meth:`Debugger.at_line`: that one has no text.
    :param name: the rule; id or class of the goal; the action; the skill string, or the skill alone.
    :param state: the goal's mode, the action's state, the skill's status; the number of the line.
    :param outcome: of the goal.
    :param condition: a CLIPS expression that must not be FALSE; empty: always.
    :param hits: how often it must have been reached: ``3``, ``>=3``, ``%3`` ...; empty: any time.
    :param log: a text that is logged in place of a stop; CLIPS in braces is evaluated. Empty: it stops.
    """

    number: int
    kind: str
    name: str
    state: str = ANY
    outcome: str = ANY
    condition: str = ""
    hits: str = ""
    log: str = ""

    @property
    def is_of_rules(self) -> bool:
        """Whether it stops at a rule rather than at what rules bring about."""
        return self.kind in ("before", "after")

    @property
    def is_of_transitions(self) -> bool:
        """Whether it stops at transitions and skills."""
        return self.kind in ("goal", "action", "skill")

    def has_rule(self, rule: str) -> bool:
        """Whether it names a rule; only of those that stop at rules."""
        return fnmatchcase(rule, self.name)

    def has_line(self, rule: str, line: int) -> bool:
        """Whether it stops at a line of a right-hand side."""
        return self.kind == "line" and self.state == str(line) and fnmatchcase(rule, self.name)

    def is_due(self, reached: int) -> bool:
        """Whether it stops when it is reached for this time, from 1."""
        found = _COUNT.fullmatch(self.hits)
        return found is None or _COMPARED[found[1] or "="](reached, int(found[2]))

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
            and (
                fnmatchcase(event.skill_string, self.name)
                or fnmatchcase(skill_name(event.skill_string), self.name)
            )
            and fnmatchcase(event.status, self.state)
        )

    def logged(self, value: Callable[[str], str]) -> str:
        """Return its log line.

        :param value: gives the value of an expression, as text.
        """
        return _EXPRESSION.sub(lambda found: value(found[1]), self.log)

    def __str__(self) -> str:
        """Return it as :func:`parse_breakpoint` takes it."""
        parts = ["rule" if self.kind == "before" else self.kind, self.name]
        if self.outcome != ANY:
            parts += [self.state, self.outcome]
        elif self.state != ANY:
            parts.append(self.state)
        text = ":".join(parts) + (f" hit {self.hits}" if self.hits else "")
        text += f" if {self.condition}" if self.condition else ""
        return text + (f' log "{self.log}"' if self.log else "")


def parse_breakpoint(spec: str) -> Breakpoint:
    """Return the breakpoint that a text stands for; see docs/debugging.md.

    :raises ExecutiveError: when it stands for none.
    """
    if len(spec) > LONGEST:
        raise ExecutiveError(f"a breakpoint has at most {LONGEST} characters, this one has {len(spec)}")
    rest, *log = _LOG.split(spec.strip(), maxsplit=1)
    place, *condition = _CONDITION.split(rest, maxsplit=1)
    place, *hits = _HITS.split(place, maxsplit=1)
    kind, colon, rest = place.partition(":")
    known = _KINDS.get(kind)
    if known is None or not colon or not rest:
        raise ExecutiveError(
            f"'{spec}' is not a breakpoint",
            hint=f'use one of: {_FORMS}; each may end in: hit COUNT if (CLIPS) log "TEXT"',
        )
    if hits:
        check_hits(hits[0])
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
    name, state, outcome = [part or ANY for part in (*parts, "", "")][:3]
    return Breakpoint(0, known, name, state, outcome, "".join(condition), "".join(hits[:1]), "".join(log[:1]))


def skill_name(skill_string: str) -> str:
    """Return the name of the skill, without its arguments."""
    return _ARGUMENTS.split(skill_string.strip(), maxsplit=1)[0]


def check_hits(hits: str) -> None:
    """See that a text says how often a breakpoint must be reached.

    :raises ExecutiveError: when it does not.
    """
    found = _COUNT.fullmatch(hits)
    if hits and (found is None or int(found[2]) == 0):
        raise ExecutiveError(
            f"'{hits}' is not a count of how often a breakpoint is reached", hint="e.g. 3, >=3, %3"
        )


@dataclass(frozen=True, slots=True)
class Stop:
    """The executive has stopped.

    :param kind: ``before``, ``after``, ``line``, ``transition``, ``step`` or ``asked``.
    :param reason: why, for people.
    :param breakpoint: number of the breakpoint; 0: there is none.
    :param rule: what fired last in this loop; empty: nothing.
    :param next_rule: what fires next; empty: the agenda is empty.
    :param event: the transition, of one.
    :param loop: number of the loop, of those that the debugger has seen; from 1.
    :param fired: how many rules have fired in this loop.
    :param time_us: on the run's clock.
    :param line: where ``rule`` is, when it is stopped within its right-hand side; 0: between rules.
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
    line: int = 0

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
