"""Breakpoints on rules, goals, plan-actions and skills, and their notation: ``goal:NAME:MODE if (CLIPS)``."""

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

ANY_NAME: Final = "*"  # the pattern in place of an omitted part

MAX_LENGTH: Final = 4096  # limit of a breakpoint's text: clients of a daemon set breakpoints, too

# The parts of the notation, as in: skill:NAME:S_FAILED hit 3 if (CLIPS) log "TEXT {CLIPS}"
_STATUS_SUFFIX = re.compile(r"(.+):(S_[A-Z*?]+)", re.DOTALL)
_CONDITION_START = re.compile(r"\s+if\s+(?=\()")
_HITS_SUFFIX = re.compile(r"\s+hit\s+(\S+)\Z")
_LOG_SUFFIX = re.compile(r'\s+log\s+"(.*)"\Z', re.DOTALL)
# the end of the name in a skill string
_ARGUMENTS_START = re.compile(r"[\s({]")
_BRACED_EXPRESSION = re.compile(r"\{([^{}]*)\}")
_HIT_COUNT = re.compile(r"(<=|>=|==|=|<|>|%)?\s*(\d{1,9})")
_COMPARISONS: Final[Mapping[str, Callable[[int, int], bool]]] = {
    "=": operator.eq,
    "==": operator.eq,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "%": lambda hits, divisor: hits % divisor == 0,
}

_KINDS_BY_PREFIX: Final = {"rule": "before", "before": "before", "after": "after"} | {
    kind: kind for kind in ("goal", "action", "skill")
}
# the maximum number of parts after the kind, separated by colons
_MAX_PARTS: Final = {"before": 1, "after": 1, "goal": 3, "action": 2}
_NOTATIONS: Final = (
    "rule:NAME, after:NAME, goal:NAME[:MODE[:OUTCOME]], action:NAME[:STATE], skill:SKILL[:STATUS]"
)


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """A breakpoint. The name, the state and the outcome are shell patterns.

    :param number: the number that :meth:`Debugger.add` assigns; 0 before the assignment.
    :param kind: ``before`` or ``after`` a rule, a ``goal``, an ``action``, a ``skill``, or a ``line`` of a
        right-hand side. A ``line`` breakpoint has no notation, see :meth:`Debugger.stop_at_line`.
    :param name: the rule, the goal's id or class, the action, the skill string, or the skill's name.
    :param state: the goal's mode, the action's state, the skill's status, or the number of the line.
    :param outcome: the goal's outcome.
    :param condition: a CLIPS expression; FALSE prevents the stop. Empty without a condition.
    :param hit_condition: the required count of hits, such as ``3``, ``>=3``, or ``%3`` for each third hit;
        empty for any count.
    :param log_message: a text to log instead of stopping, with CLIPS expressions in braces; empty to stop.
    """

    number: int
    kind: str
    name: str
    state: str = ANY_NAME
    outcome: str = ANY_NAME
    condition: str = ""
    hit_condition: str = ""
    log_message: str = ""

    @property
    def is_rule_breakpoint(self) -> bool:
        """Whether the breakpoint stops before or after rules."""
        return self.kind in ("before", "after")

    @property
    def is_transition_breakpoint(self) -> bool:
        """Whether the breakpoint stops at transitions of goals, plan-actions or skills."""
        return self.kind in ("goal", "action", "skill")

    def matches_rule(self, rule: str) -> bool:
        """Return whether the name of a rule breakpoint matches a rule."""
        return fnmatchcase(rule, self.name)

    def matches_line(self, rule: str, line: int) -> bool:
        """Return whether the breakpoint is on a line of a right-hand side."""
        return self.kind == "line" and self.state == str(line) and fnmatchcase(rule, self.name)

    def stops_at_hit(self, hit_number: int) -> bool:
        """Return whether the breakpoint stops at a hit; its number counts from 1."""
        match = _HIT_COUNT.fullmatch(self.hit_condition)
        return match is None or _COMPARISONS[match[1] or "="](hit_number, int(match[2]))

    def matches_transition(self, event: Transition) -> bool:
        """Return whether the breakpoint matches a transition."""
        if isinstance(event, GoalTransition):
            kind, names, state = "goal", [event.goal, event.goal_class], event.mode
        elif isinstance(event, PlanActionTransition):
            kind, names, state = "action", [event.action], event.state
        else:
            names = [event.skill_string, read_skill_name(event.skill_string)]
            kind, state = "skill", event.status
        return (
            self.kind == kind
            and any(fnmatchcase(name, self.name) for name in names)
            and fnmatchcase(state, self.state)
            and (not isinstance(event, GoalTransition) or fnmatchcase(event.outcome, self.outcome))
        )

    def format_log(self, evaluate: Callable[[str], str]) -> str:
        """Return the text to log, with the values of its expressions.

        :param evaluate: returns the value of a CLIPS expression as text.
        """
        return _BRACED_EXPRESSION.sub(lambda match: evaluate(match[1]), self.log_message)

    def __str__(self) -> str:
        """Return the breakpoint in the notation of :func:`parse_breakpoint`."""
        state = f":{self.state}" if (self.state, self.outcome) != (ANY_NAME, ANY_NAME) else ""
        outcome = f":{self.outcome}" if self.outcome != ANY_NAME else ""
        hits = f" hit {self.hit_condition}" if self.hit_condition else ""
        condition = f" if {self.condition}" if self.condition else ""
        log = f' log "{self.log_message}"' if self.log_message else ""
        kind = "rule" if self.kind == "before" else self.kind
        return f"{kind}:{self.name}{state}{outcome}{hits}{condition}{log}"


def parse_breakpoint(spec: str) -> Breakpoint:
    """Parse the text of a breakpoint; docs/debugging.md describes the notation.

    :raises ExecutiveError: if the text is not a breakpoint.
    """
    if len(spec) > MAX_LENGTH:
        raise ExecutiveError(f"a breakpoint has at most {MAX_LENGTH} characters, this one has {len(spec)}")
    # Parse from the end: the text to log may contain a condition, and the condition may contain colons.
    # Each split returns the text before the match, the groups, and the text after the match; without a match,
    # only the text.
    before_log, *log = _LOG_SUFFIX.split(spec.strip(), maxsplit=1)
    before_condition, *condition = _CONDITION_START.split(before_log, maxsplit=1)
    subject, *hits = _HITS_SUFFIX.split(before_condition, maxsplit=1)
    prefix, _, pattern = subject.partition(":")
    kind = _KINDS_BY_PREFIX.get(prefix)
    if kind is None or not pattern:
        raise ExecutiveError(
            f"'{spec}' is not a breakpoint",
            hint=f'use one of: {_NOTATIONS}; each may end in: hit COUNT if (CLIPS) log "TEXT"',
        )
    if hits:
        check_hit_condition(hits[0])
    if kind == "skill":
        # A skill string may contain colons, so only an end such as ``:S_FAILED`` is a status.
        match = _STATUS_SUFFIX.fullmatch(pattern)
        name_parts = list(match.groups()) if match else [pattern]
    else:
        name_parts = pattern.split(":")
        if len(name_parts) > _MAX_PARTS[kind]:
            raise ExecutiveError(
                f"'{spec}' has too many parts for a breakpoint", hint=f"use one of: {_NOTATIONS}"
            )
    # Two empty parts stand for an omitted state and outcome.
    name, state, outcome = [text or ANY_NAME for text in (*name_parts, "", "")][:3]
    return Breakpoint(0, kind, name, state, outcome, "".join(condition), "".join(hits[:1]), "".join(log[:1]))


def read_skill_name(skill_string: str) -> str:
    """Return the name of the skill in a skill string, such as ``say`` in ``say{text="x"}``."""
    return _ARGUMENTS_START.split(skill_string.strip(), maxsplit=1)[0]


def check_hit_condition(hit_condition: str) -> None:
    """Check the notation of :attr:`Breakpoint.hit_condition`; an empty text passes.

    :raises ExecutiveError: if the text is not a hit count, or its number is 0.
    """
    match = _HIT_COUNT.fullmatch(hit_condition)
    if hit_condition and (match is None or int(match[2]) == 0):
        raise ExecutiveError(f"'{hit_condition}' is not a hit count", hint="e.g. 3, >=3, %3")


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop of the executive.

    :param kind: ``before`` or ``after`` a rule, at a ``line`` or ``transition``, at the end of a ``step``, or
        ``asked`` if a user requested the stop.
    :param reason: the reason as text.
    :param breakpoint: the number of the breakpoint; 0 without a breakpoint.
    :param rule: the last rule fired in this loop, or the rule of the line; empty if none has fired.
    :param next_rule: the first rule of the agenda; empty if there is none.
    :param event: the transition that caused the stop; None without a transition.
    :param loop: the number of the loop among those that the debugger has run, from 1.
    :param fired: the number of firings in this loop; at a line, without those of the unfinished run of CLIPS.
    :param time_us: the time of the run's clock, in microseconds.
    :param line: the line within the right-hand side of ``rule``; 0 between rules.
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


def describe_transition(event: Transition) -> str:
    """Return a transition in one line of text."""
    if isinstance(event, GoalTransition):
        outcome = f" {event.outcome}" if event.outcome not in ("", "UNKNOWN") else ""
        error = f", error: {event.error}" if event.error else ""
        return f"goal {event.goal} ({event.goal_class}) is {event.mode}{outcome}{error}"
    if isinstance(event, PlanActionTransition):
        return f"action {event.action} ({event.goal}/{event.plan}/{event.action_id}) is {event.state}"
    return f"skill {event.skill_string or '(none)'} of {event.skiller} is {event.status}"
