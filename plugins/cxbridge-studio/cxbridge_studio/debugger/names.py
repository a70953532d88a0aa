"""Detection of unreachable breakpoints: unknown rules, modes, states and skills.

Only a name that the loaded agent rules out counts as a mistake. Rules create the names of goals and
plan-actions at run time, so :class:`MetNames` checks those after the run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import TOKEN
from cxbridge.errors import ExecutiveError
from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.executive.host.constructs import construct_names
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.suggestions import did_you_mean, or_similar
from cxbridge_studio.constructs import allowed_values
from cxbridge_studio.debugger.breakpoints import ANY, Breakpoint, skill_name

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

# The functions that define constructs, from a file or from a text.
_LOADERS: Final = frozenset(
    {"load", "load*", "batch", "batch*", "path-load", "path-load*", "path-batch", "path-batch*"}
    | {"bload", "build"}
)

_COLON_STATUS: Final = re.compile(r".*:(\w+)", re.DOTALL)
_LITERAL: Final = re.compile(r"[^*?\[{(]*")
_WILDCARDS: Final = "*?["
_MAX_NAMES: Final = 10_000  # the limit of the names that are kept for suggestions, per kind

# Unreachable breakpoints, with the reasons.
Mistakes = Sequence[tuple[Breakpoint, ExecutiveError]]


class AgentNames:
    """The names that can occur in an agent.

    :param env: the agent's environment.
    :param skills: returns the existing skills; None if they are unknown.
    :param is_initial: returns whether a file belongs to the initialisation.
    """

    def __init__(
        self,
        env: ClipsEnvironment,
        skills: Callable[[], Collection[str] | None] = lambda: None,
        is_initial: Callable[[Path], bool] = lambda _file: False,
    ) -> None:
        self._env = env
        self._skills = skills
        self._is_initial = is_initial
        self._log = env.bus.logger("Debugger")
        self._is_checked = False
        # Receives the unreachable breakpoints once, after the agent's initialisation.
        self.on_mistakes: Callable[[Mistakes], None] = self._warn

    @property
    def are_complete(self) -> bool:
        """Whether the agent is initialised, so that all its files are known."""
        return next(self._env.facts("executive-initialized"), None) is not None

    def check(self, item: Breakpoint) -> None:
        """Check that a breakpoint is reachable. All breakpoints pass before the initialisation.

        :raises ExecutiveError: if the breakpoint is unreachable.
        """
        with self._env.lock:
            if self.are_complete:
                self._check_names(item)

    def check_once(self, items: Iterable[Breakpoint]) -> None:
        """Check all breakpoints in the loop that completes the initialisation."""
        if self._is_checked or not self.are_complete:
            return
        self._is_checked = True
        mistakes = []
        for item in items:
            try:
                self._check_names(item)
            except ExecutiveError as error:
                mistakes.append((item, error))
        self.on_mistakes(mistakes)

    def _warn(self, mistakes: Mistakes) -> None:
        for _, error in mistakes:
            self._log.warn(" ".join(str(error).split()))

    def _check_names(self, item: Breakpoint) -> None:
        mistake = self._find_mistake(item)
        if mistake is None:
            return
        problem, hint = mistake
        message = f"breakpoint {item}: {problem}"
        if not (item.is_of_rules and self._may_load):
            raise ExecutiveError(message, hint=hint)
        # A file that the agent loads later may have the rule.
        self._log.warn(f"{message} yet{f': {hint}' if hint else ''}")

    def _find_mistake(self, item: Breakpoint) -> tuple[str, str] | None:
        """Return the problem of a breakpoint and a hint; None if the breakpoint is reachable."""
        if item.is_of_rules:
            return self._rule_mistake(item.name)
        if item.kind == "goal":
            return self._goal_mistake(item)
        if item.kind == "action":
            states = allowed_values(self._env, "plan-action", "state")
            return _name_mistake(item.state, states, "plan-actions have no state", "the states are")
        return self._skill_mistake(item) if item.kind == "skill" else None

    def _rule_mistake(self, name: str) -> tuple[str, str] | None:
        rules = construct_names(self._env, "defrule")
        if name.strip("*") == "" or any(fnmatchcase(rule, name) for rule in rules):
            return None
        is_pattern = any(wildcard in name for wildcard in _WILDCARDS)
        problem = "no rule matches" if is_pattern else "there is no rule"
        return f"{problem} '{name}'", did_you_mean(_without_wildcards(name), rules)

    def _goal_mistake(self, item: Breakpoint) -> tuple[str, str] | None:
        modes = allowed_values(self._env, "goal", "mode")
        outcomes = allowed_values(self._env, "goal", "outcome")
        mistake = _name_mistake(item.state, modes, "goals have no mode", "the modes are")
        if mistake is None:
            return _name_mistake(item.outcome, outcomes, "goals have no outcome", "the outcomes are")
        if item.state in outcomes:
            problem, _ = mistake
            return problem, f"{item.state} is an outcome: use goal:{item.name}:*:{item.state}"
        return mistake

    def _skill_mistake(self, item: Breakpoint) -> tuple[str, str] | None:
        end = _COLON_STATUS.fullmatch(item.name)  # no skill string ends with a status
        status = end[1] if end else item.state
        mistake = _name_mistake(status, skill_statuses(), "skills have no status", "these are")
        skills = None if mistake else self._skills()
        if mistake or skills is None:
            return mistake
        match = _LITERAL.match(item.name)
        literal = match[0] if match else ""
        # Before a wildcard, the literal is only the beginning of the skill's name.
        is_whole = not item.name[len(literal) :].startswith(tuple(_WILDCARDS))
        name = literal.strip()
        if any(skill == name if is_whole else skill.startswith(name) for skill in skills):
            return None
        all_skills = f"there are: {', '.join(sorted(skills)) or 'none'}"
        return f"there is no skill '{name}{'' if is_whole else '*'}'", did_you_mean(name, skills, all_skills)

    @property
    def _may_load(self) -> bool:
        """Return whether the agent may load further files: it calls a loader with an unknown or new file."""
        files = self._env.loader.files
        texts = (_text(file) for file in dict.fromkeys(files) if not self._is_initial(file))
        return any(_loads_further_file(text, files) for text in texts)


class MetNames:
    """The names of goals, plan-actions and skills that occurred in a run."""

    def __init__(self) -> None:
        self._names: dict[str, set[str]] = {"goal": set(), "action": set(), "skill": set()}
        self._ids: set[str] = set()

    def take(self, event: Event) -> None:
        """Add the names of a transition."""
        if isinstance(event, GoalTransition):
            self._add("goal", event.goal_class)
            if len(self._ids) < _MAX_NAMES:
                self._ids.add(event.goal)
        elif isinstance(event, PlanActionTransition):
            self._add("action", event.action)
        elif isinstance(event, SkillStatus):
            self._add("skill", skill_name(event.skill_string))

    def _add(self, kind: str, name: str) -> None:
        if name and len(self._names[kind]) < _MAX_NAMES:
            self._names[kind].add(name)

    def lacks(self, item: Breakpoint) -> str:
        """Return a message if a breakpoint's name has not occurred; else empty."""
        names = self._names.get(item.kind)
        if names is None:
            return ""
        pattern = skill_name(item.name) if item.kind == "skill" else item.name
        all_names = names | self._ids if item.kind == "goal" else names
        # With as many names as the limit, the name may be among those that were not kept.
        if len(all_names) >= _MAX_NAMES or any(fnmatchcase(name, pattern) for name in all_names):
            return ""
        return f"there was no {item.kind} '{pattern}'{or_similar(_without_wildcards(pattern), names)}"


def skill_statuses() -> tuple[str, ...]:
    """Return the statuses of skills, as defined by SkillerInterface."""
    enums = InterfaceRegistry().schema("SkillerInterface").enums
    return tuple(item.name for enum in enums if enum.name == "SkillStatusEnum" for item in enum.items)


def _name_mistake(pattern: str, names: Collection[str], problem: str, title: str) -> tuple[str, str] | None:
    """Return message and hint if no name matches a pattern; None if a name matches, or there are none.

    :param title: the title of the list of names in the hint.
    """
    if pattern == ANY or not names or any(fnmatchcase(name, pattern) for name in names):
        return None
    hint = did_you_mean(_without_wildcards(pattern), names, f"{title}: {', '.join(names)}")
    return f"{problem} '{pattern}'", hint


def _without_wildcards(pattern: str) -> str:
    return pattern.translate(dict.fromkeys(map(ord, "*?[]")))


def _text(file: Path) -> str:
    try:
        return file.read_text("utf-8", "surrogateescape")
    except OSError:
        return ""


def _loads_further_file(text: str, loaded: Iterable[Path]) -> bool:
    """Return whether a text calls a function that defines constructs with a file that is not loaded yet."""
    tokens = (match[0] for match in TOKEN.finditer(text) if match.lastgroup != "blank")
    for token in tokens:
        if token in _LOADERS:
            argument = next(tokens, "")
            name = argument.strip('"') if argument.startswith('"') else ""
            if not name or not any(f"/{file}".endswith(f"/{name}") for file in loaded):
                return True
    return False
