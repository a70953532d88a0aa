"""Detects unreachable breakpoints: unknown rules, modes, states and skills.

A name counts as a mistake only if it cannot occur in the loaded agent. Rules create the names of goals and
plan-actions at run time, so any of these names passes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from cxbridge.errors import ExecutiveError
from cxbridge.executive.host.constructs import construct_names
from cxbridge.skiller.status import Status
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.constructs import read_allowed_values
from cxbridge_studio.debugger.breakpoints import ANY_NAME, Breakpoint

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

# a word at the end of a skill breakpoint, which may be a misspelt status
_STATUS_SUFFIX: Final = re.compile(r".*:(\w+)", re.DOTALL)
# the skill's name before a wildcard or the arguments
_LITERAL_START: Final = re.compile(r"[^*?\[{(]*")
_WILDCARDS: Final = "*?["

# Unreachable breakpoints, each with the reason as an error.
BreakpointMistakes = Sequence[tuple[Breakpoint, ExecutiveError]]


class BreakpointChecker:
    """Checks breakpoints against the names that can occur in an agent.

    :param env: the agent's environment.
    :param find_skills: returns the existing skills; None if they are unknown.
    """

    def __init__(
        self,
        env: ClipsEnvironment,
        find_skills: Callable[[], Collection[str] | None] = lambda: None,
    ) -> None:
        self._env = env
        self._find_skills = find_skills
        self._log = env.bus.logger("Debugger")
        self._is_checked = False
        # The callback for the unreachable breakpoints, called once after the agent's initialisation.
        self.on_mistakes: Callable[[BreakpointMistakes], None] = self._log_mistakes

    @property
    def is_initialised(self) -> bool:
        """Whether the agent is initialised, so that all its files are known."""
        return next(self._env.facts("executive-initialized"), None) is not None

    def check(self, tested_breakpoint: Breakpoint) -> None:
        """Check that a breakpoint is reachable. Before the end of the initialisation, any breakpoint passes.

        :raises ExecutiveError: if the breakpoint is unreachable.
        """
        mistake = self.find_mistake(tested_breakpoint)
        if mistake is not None:
            raise mistake

    def find_mistake(self, tested_breakpoint: Breakpoint) -> ExecutiveError | None:
        """Return why a breakpoint is unreachable; None if it is reachable, or before the initialisation."""
        with self._env.lock:
            mistake = self._find_unknown_name(tested_breakpoint) if self.is_initialised else None
        if mistake is None:
            return None
        problem, hint = mistake
        return ExecutiveError(f"breakpoint {tested_breakpoint}: {problem}", hint=hint)

    def check_once(self, tested_breakpoints: Iterable[Breakpoint]) -> None:
        """Pass the unreachable breakpoints to :attr:`on_mistakes`, once after the initialisation."""
        if self._is_checked or not self.is_initialised:
            return
        self._is_checked = True
        self.on_mistakes(
            [
                (tested_breakpoint, mistake)
                for tested_breakpoint in tested_breakpoints
                if (mistake := self.find_mistake(tested_breakpoint)) is not None
            ]
        )

    def _log_mistakes(self, mistakes: BreakpointMistakes) -> None:
        for _, error in mistakes:
            self._log.warn(" ".join(str(error).split()))

    def _find_unknown_name(self, tested_breakpoint: Breakpoint) -> tuple[str, str] | None:
        """Return a message and a hint about a name that cannot occur; None if all names can."""
        if tested_breakpoint.is_rule_breakpoint:
            return self._find_rule_mistake(tested_breakpoint.name)
        if tested_breakpoint.kind == "goal":
            return self._find_goal_mistake(tested_breakpoint)
        if tested_breakpoint.kind == "action":
            states = read_allowed_values(self._env, "plan-action", "state")
            return _find_name_mistake(
                tested_breakpoint.state, states, "plan-actions have no state", "the states are"
            )
        return self._find_skill_mistake(tested_breakpoint) if tested_breakpoint.kind == "skill" else None

    def _find_rule_mistake(self, name: str) -> tuple[str, str] | None:
        rules = construct_names(self._env, "defrule")
        if name.strip("*") == "" or any(fnmatchcase(rule, name) for rule in rules):
            return None
        is_pattern = any(wildcard in name for wildcard in _WILDCARDS)
        problem = "no rule matches" if is_pattern else "there is no rule"
        return f"{problem} '{name}'", did_you_mean(_strip_wildcards(name), rules)

    def _find_goal_mistake(self, tested_breakpoint: Breakpoint) -> tuple[str, str] | None:
        state = tested_breakpoint.state
        modes = read_allowed_values(self._env, "goal", "mode")
        outcomes = read_allowed_values(self._env, "goal", "outcome")
        mistake = _find_name_mistake(state, modes, "goals have no mode", "the modes are")
        if mistake is None:
            outcome = tested_breakpoint.outcome
            return _find_name_mistake(outcome, outcomes, "goals have no outcome", "the outcomes are")
        if state in outcomes:
            problem, _ = mistake
            return problem, f"{state} is an outcome: use goal:{tested_breakpoint.name}:*:{state}"
        return mistake

    def _find_skill_mistake(self, tested_breakpoint: Breakpoint) -> tuple[str, str] | None:
        # The parser takes only a word that begins with S_ for the status, so that a misspelt status is a part
        # of the name.
        status_match = _STATUS_SUFFIX.fullmatch(tested_breakpoint.name)
        status = status_match[1] if status_match else tested_breakpoint.state
        statuses = Status.__members__
        mistake = _find_name_mistake(status, statuses, "skills have no status", "the statuses are")
        skills = None if mistake else self._find_skills()
        if mistake or skills is None:
            return mistake
        match = _LITERAL_START.match(tested_breakpoint.name)
        literal_prefix = match[0] if match else ""
        # With a wildcard after it, the literal is only the beginning of a skill's name.
        is_whole_name = not tested_breakpoint.name[len(literal_prefix) :].startswith(tuple(_WILDCARDS))
        name = literal_prefix.strip()
        if any(skill == name if is_whole_name else skill.startswith(name) for skill in skills):
            return None
        all_skills = f"there are: {', '.join(sorted(skills)) or 'none'}"
        return f"there is no skill '{name}{'' if is_whole_name else '*'}'", did_you_mean(
            name, skills, all_skills
        )


def _find_name_mistake(
    pattern: str, names: Collection[str], problem: str, title: str
) -> tuple[str, str] | None:
    """Return a message and a hint if no name matches a pattern; None if one matches, or none is known.

    :param problem: the beginning of the message.
    :param title: the beginning of the list of names in the hint.
    """
    if pattern == ANY_NAME or not names or any(fnmatchcase(name, pattern) for name in names):
        return None
    hint = did_you_mean(_strip_wildcards(pattern), names, f"{title}: {', '.join(names)}")
    return f"{problem} '{pattern}'", hint


def _strip_wildcards(pattern: str) -> str:
    return pattern.translate(dict.fromkeys(map(ord, "*?[]")))
