"""Mistakes of an agent that a run finds while loading. A broken agent does not start.

The checks load nothing themselves. They collect the diagnostics of the CLIPS loader, the PDDL parser and the
blackboard, and compare the action mapping with skills and operators.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.errors import BrokenAgentError, ConfigError, CxbridgeError, SkillError
from cxbridge.executive.executive import action_mapping
from cxbridge.skiller.luacalls import read_calls
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge.skiller.templates import Placeholder, parse_template
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.loading import Diagnostic
    from cxbridge.run.agent import Run

UNCLOSED: Final = "UNCLOSED"
# CLIPS error codes for unknown names, which may be defined in a missing file.
_UNKNOWN_NAME: Final = frozenset({"EXPRNPSR3", "GLOBLPSR1", "PRNTUTIL2"})

_QUOTED: Final = re.compile(r"'([^']+)'")


class AgentChecks:
    """Finds mistakes in the agents of a run. Each mistake is reported once.

    :param agents: made but not started. Their mistakes are no longer logged individually.
    :param strict: overrides :attr:`RunOptions.strict`.
    """

    def __init__(self, agents: Iterable[Run], *, strict: bool | None = None) -> None:
        self._strict = strict
        self._agents: list[_Agent] = []
        self._missing: list[CxbridgeError] = []
        for agent in agents:
            self.joined(agent)

    def joined(self, agent: Run) -> None:
        """Add an agent before its start.

        For an agent that is lenient by default, only missing files count, see
        :attr:`~cxbridge.run.source.Source.is_lenient`.
        """
        options = agent.options
        strict = options.strict if self._strict is None else self._strict
        if strict or (strict is None and not agent.source.is_lenient):
            self._agents.append(_Agent(agent, agent.executive))
        elif strict is None:
            self._missing += agent.missing

    def left(self, agent: Run) -> None:
        """Remove a killed agent."""
        self._agents = [each for each in self._agents if not each.is_of(agent.executive)]

    def start(self) -> None:
        """Check the files loaded so far.

        :raises BrokenAgentError: if an agent has mistakes.
        """
        found = [mistake for agent in self._agents for mistake in (*agent.missing, *agent.new())]
        self._raise([*self._missing, *found])

    def look(self) -> None:
        """Check the files loaded since the last call. To be called after each loop.

        :raises BrokenAgentError: if an agent has mistakes.
        """
        for agent in self._agents:
            if agent.has_news:
                started = agent.is_initialized
                self._raise(agent.new(), started=started)

    @property
    def all_initialized(self) -> bool:
        return all(agent.is_initialized for agent in self._agents)

    @staticmethod
    def _raise(mistakes: list[CxbridgeError], *, started: bool = False) -> None:
        if mistakes:
            raise BrokenAgentError(
                [*{str(mistake): mistake for mistake in mistakes}.values()], started=started
            )


class _Agent:
    def __init__(self, context: Run, executive: Executive) -> None:
        self._context, self._executive = context, executive
        self._loader = executive.env.loader
        self._loader.quiet = True
        self._seen = 0
        self.is_initialized = False

    def is_of(self, executive: Executive) -> bool:
        return self._executive is executive

    @property
    def missing(self) -> list[ConfigError]:
        """The missing files."""
        return self._context.missing

    @property
    def has_news(self) -> bool:
        """Whether new findings are possible."""
        if len(self._loader.diagnostics) > self._seen:
            return True
        return not self.is_initialized and self._executive.initialized

    def new(self) -> list[CxbridgeError]:
        """Return the mistakes since the last call."""
        diagnostics = self._loader.diagnostics[self._seen :]
        self._seen += len(diagnostics)
        found = list(_causes(diagnostics, files_are_missing=bool(self.missing)))
        if not self.is_initialized and self._executive.initialized:
            self.is_initialized = True
            if not found and not self.missing:
                found += mapping_mistakes(self._context, self._executive)
        return found


def _causes(diagnostics: Iterable[Diagnostic], *, files_are_missing: bool) -> Iterator[CxbridgeError]:
    """Yield the root mistakes, without consequences of other mistakes.

    :param files_are_missing: unknown names may be defined in the missing files.
    """
    diagnostics = list(dict.fromkeys(diagnostics))
    unclosed = {
        diagnostic.file: diagnostic.line or 0 for diagnostic in diagnostics if diagnostic.code == UNCLOSED
    }
    lost = {diagnostic.construct.partition(" ")[2] for diagnostic in diagnostics if diagnostic.construct}
    for each in diagnostics:
        start = unclosed.get(each.file)
        if each.code != UNCLOSED:
            if start is not None and (each.line is None or each.line >= start):
                continue  # CLIPS' report of the same unclosed parenthesis
            if files_are_missing and each.code in _UNKNOWN_NAME:
                continue
            if lost.intersection(_QUOTED.findall(each.message)) and each.code in _UNKNOWN_NAME:
                continue
            if each.code in _UNKNOWN_NAME and names_any(each.file, each.line, lost):
                continue
        construct = f"{each.construct} is not defined: " if each.construct else ""
        code = "" if each.code.isupper() and each.code.isalpha() else f" [{each.code}]"
        yield CxbridgeError(
            f"{construct}{each.message}{code}", file=each.file, line=each.line, hint=each.hint or None
        )


def names_any(file: str | None, line: int | None, constructs: Collection[str]) -> bool:
    """Return whether a line has a list that starts with the name of one of these constructs."""
    if not (file and line and constructs):
        return False
    try:
        text = Path(file).read_text("utf-8", "surrogateescape").splitlines()[line - 1]
    except (OSError, IndexError):
        return False
    return any(re.search(rf"\({re.escape(name)}[\s)]", text) for name in constructs)


def mapping_mistakes(context: Run, executive: Executive) -> list[CxbridgeError]:
    """Return the unknown skills and parameters in the action mapping."""
    skills = known_skills(context)
    operators = (
        {
            str(slots["name"]): [str(name) for name in slots["param-names"]]
            for _, _, slots in executive.env.facts("domain-operator")
            if isinstance(slots["param-names"], tuple)
        }
        if executive.env.has_template("domain-operator")
        else {}
    )
    found: list[CxbridgeError] = []
    lost: CxbridgeError | None = None
    for action, template in action_mapping(context.config, context.spec).items():
        parameters = operators.get(action)
        for name in _parameters(template):
            if parameters and name not in parameters:
                text = f"'{action}' has no parameter '{name}'"
                found.append(_of_mapping(context, action, text, name, parameters))
        if skills is None:
            continue
        try:
            names = [call.name for call in read_calls(_with_values(action, template))]
        except SkillError as error:
            text = f"the skill string of '{action}' is wrong: {error.message}"
            found.append(context.config.error(_path(context, action), text))
            continue
        for name in names:
            if name not in skills:
                text = f"'{action}' is mapped to the skill '{name}', which does not exist"
                found.append(_of_mapping(context, action, text, name, skills))
                lost = found[-1]
    if lost is not None and context.known_skills:
        end = "" if (lost.hint or "").endswith("?") else "."
        lost.hint = f"{lost.hint}{end} Without the robot, --skiller simulator executes any skill"
    return found


def _parameters(template: str) -> list[str]:
    return [part.name for part in parse_template(template) if isinstance(part, Placeholder)]


def _with_values(action: str, template: str) -> str:
    mapping = ActionSkillMapping({action: template})
    return mapping.map(action, dict.fromkeys(_parameters(template), "1")).text or f"{template}"


def known_skills(context: Run) -> frozenset[str] | None:
    """Return the skills available to the action mapping; None if another process has them."""
    board = context.skill_board
    if not context.known_skills and board is None:
        return None
    if None in context.known_skills.values() or (board is not None and not board.in_process):
        return None
    found = {skill for skills in context.known_skills.values() for skill in skills or ()}
    for agent in () if board is None else board.agents:
        for executor in agent.executors:
            found.update(executor.skills())
    return frozenset(found)


def _of_mapping(context: Run, action: str, message: str, word: str, known: Iterable[str]) -> ConfigError:
    known = sorted(known)
    hint = did_you_mean(word, known, f"there are: {', '.join(known) or 'none'}")
    return context.config.error(_path(context, action), message, hint)


def _path(context: Run, action: str) -> str:
    return f"/clips-executive/specs/{context.spec}/action-mapping/{action}"
