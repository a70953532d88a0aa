"""Mistakes of an agent that a run finds while it loads the files, and actions without an executor.

A broken agent does not start, unless it is lenient (:attr:`~cxbridge.run.source.Source.is_lenient`).
The checks load nothing themselves: they collect the diagnostics of the CLIPS loader, the PDDL parser and the
blackboard, and compare the action mapping with skills and operators.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.errors import BrokenAgentError, ConfigError, CxbridgeError, SkillError
from cxbridge.executive.executive import read_action_mapping
from cxbridge.executive.host.loading import UNCLOSED
from cxbridge.run.explainers import place_of_action
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge.skiller.skillstring import read_calls
from cxbridge.skiller.templates import Placeholder, parse_template
from cxbridge.suggestions import did_you_mean, nearest_names

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.loading import Diagnostic
    from cxbridge.run.agent import Run

# CLIPS error codes for unknown names, which may be defined in a missing file.
_UNKNOWN_NAME_CODES: Final = frozenset({"EXPRNPSR3", "GLOBLPSR1", "PRNTUTIL2"})

_QUOTED_NAME: Final = re.compile(r"'([^']+)'")

# The start of the core's error text for an action that no rule executes.
_NO_EXECUTOR: Final = "No action executor"


class AgentChecks:
    """Finds mistakes in the agents of a run; an :class:`~cxbridge.run.team.AgentWatcher`.

    Each mistake is reported once.

    :param agents: the agents, not yet started. Their mistakes are no longer logged individually.
    :param strict: overrides :attr:`RunOptions.strict`; None: each agent's own option.
    """

    def __init__(self, agents: Iterable[Run], *, strict: bool | None = None) -> None:
        self._strict = strict
        self._loadings: list[_Loading] = []
        self._missing_file_errors: list[CxbridgeError] = []
        for agent in agents:
            self.joined(agent)

    def joined(self, agent: Run) -> None:
        """Add an agent before its start.

        For an agent that is lenient by default, only missing files count; for one that is lenient by its
        options, no mistake counts.
        """
        strict = agent.options.strict if self._strict is None else self._strict
        if strict or (strict is None and not agent.source.is_lenient):
            self._loadings.append(_Loading(agent))
        elif strict is None:
            self._missing_file_errors += agent.missing_files

    def left(self, agent: Run) -> None:
        """Remove a killed agent."""
        self._loadings = [loading for loading in self._loadings if loading.agent is not agent]

    def check_loaded_files(self) -> None:
        """Check the files that are loaded before the first cycle.

        :raises BrokenAgentError: if an agent has mistakes.
        """
        mistakes = [
            mistake
            for loading in self._loadings
            for mistake in (*loading.agent.missing_files, *loading.take_mistakes())
        ]
        self._raise_mistakes([*self._missing_file_errors, *mistakes])

    def check_new_files(self) -> None:
        """Check the files that rules have loaded since the last call. To be called after each cycle.

        :raises BrokenAgentError: if an agent has mistakes.
        """
        for loading in self._loadings:
            if loading.may_have_new_mistakes:
                started = loading.is_initialized
                self._raise_mistakes(loading.take_mistakes(), started=started)

    @property
    def all_initialized(self) -> bool:
        """Whether the initialisation has ended in all agents that are not lenient."""
        return all(loading.is_initialized for loading in self._loadings)

    @staticmethod
    def _raise_mistakes(mistakes: list[CxbridgeError], *, started: bool = False) -> None:
        """Raise an error with the mistakes, each text once; do nothing without mistakes.

        :param started: whether the agent has started, for the text of the error.
        """
        if mistakes_by_text := {str(mistake): mistake for mistake in mistakes}:
            raise BrokenAgentError([*mistakes_by_text.values()], started=started)


class _Loading:
    """The loading of an agent's files: finds the mistakes that are not yet reported."""

    def __init__(self, agent: Run) -> None:
        self.agent = agent
        self.is_initialized = False
        self._executive = agent.executive
        self._loader = self._executive.env.loader
        self._loader.is_quiet = True  # AgentChecks reports the diagnostics instead
        self._reported_count = 0

    @property
    def may_have_new_mistakes(self) -> bool:
        """Whether new mistakes are possible: after new diagnostics, and when the initialisation has ended."""
        return len(self._loader.diagnostics) > self._reported_count or (
            not self.is_initialized and self._executive.is_initialized
        )

    def take_mistakes(self) -> list[CxbridgeError]:
        """Return the mistakes since the last call."""
        diagnostics = self._loader.diagnostics[self._reported_count :]
        self._reported_count += len(diagnostics)
        missing = self.agent.missing_files
        mistakes = list(_find_root_mistakes(diagnostics, files_are_missing=bool(missing)))
        if not self.is_initialized and self._executive.is_initialized:
            self.is_initialized = True
            # after other mistakes the mapping is not checked: a broken file may define the operators and
            # skills that the mapping names
            if not mistakes and not missing:
                mistakes += _find_mapping_mistakes(self.agent)
        return mistakes


def _find_root_mistakes(
    diagnostics: Iterable[Diagnostic], *, files_are_missing: bool
) -> Iterator[CxbridgeError]:
    """Yield the root mistakes, without consequences of other mistakes.

    :param files_are_missing: whether files are missing, which may define the unknown names.
    """
    diagnostics = list(dict.fromkeys(diagnostics))
    unclosed_lines = {
        diagnostic.file: diagnostic.line or 0 for diagnostic in diagnostics if diagnostic.code == UNCLOSED
    }
    undefined_names = {
        diagnostic.construct.partition(" ")[2] for diagnostic in diagnostics if diagnostic.construct
    }
    for diagnostic in diagnostics:
        file, line, code = diagnostic.file, diagnostic.line, diagnostic.code
        # CLIPS reports an unclosed parenthesis again, in its own words
        repeats_unclosed = file in unclosed_lines and (line is None or line >= unclosed_lines[file])
        is_consequence = repeats_unclosed or (
            code in _UNKNOWN_NAME_CODES
            and (
                files_are_missing
                or not undefined_names.isdisjoint(_QUOTED_NAME.findall(diagnostic.message))
                or contains_call_to(file, line, undefined_names)
            )
        )
        if code == UNCLOSED or not is_consequence:
            construct = f"{diagnostic.construct} is not defined: " if diagnostic.construct else ""
            # codes of cxbridge are words in capitals such as UNCLOSED; users look up the codes of CLIPS only
            suffix = "" if code.isupper() and code.isalpha() else f" [{code}]"
            yield CxbridgeError(
                f"{construct}{diagnostic.message}{suffix}", file=file, line=line, hint=diagnostic.hint or None
            )


def contains_call_to(file: str | None, line: int | None, constructs: Collection[str]) -> bool:
    """Return whether a line of a file uses one of these constructs, e.g. calls one of these functions.

    False without a line, and for a line that cannot be read.
    """
    if not (file and line and constructs):
        return False
    try:
        source_line = Path(file).read_text("utf-8", "surrogateescape").splitlines()[line - 1]
    except (OSError, IndexError):  # the file may have changed since CLIPS loaded it
        return False
    return any(re.search(rf"\({re.escape(name)}[\s)]", source_line) for name in constructs)


def _find_mapping_mistakes(agent: Run) -> list[CxbridgeError]:
    """Return an error for each unknown skill or parameter, and each wrong skill string, in the mapping."""
    skills, env = known_skills(agent), agent.executive.env
    operators = {
        str(slots["name"]): [str(name) for name in slots["param-names"]]
        for _, _, slots in (env.facts("domain-operator") if env.has_template("domain-operator") else ())
        if isinstance(slots["param-names"], tuple)
    }
    mistakes: list[CxbridgeError] = []
    unknown_skill: CxbridgeError | None = None
    for action, template in read_action_mapping(agent.config, agent.spec).items():
        placeholders = [part.name for part in parse_template(template) if isinstance(part, Placeholder)]
        parameters = operators.get(action)
        for name in placeholders:
            if parameters and name not in parameters:
                text = f"'{action}' has no parameter '{name}'"
                mistakes.append(_make_mapping_mistake(agent, action, text, name, parameters))
        # the skills of a simulator are unknown, but it reads skill strings; another program may evaluate Lua
        if skills is None and agent.options.skiller != "simulator":
            continue
        # every placeholder accepts the example value 1, as a number or as text
        example = ActionSkillMapping({action: template}).map(action, dict.fromkeys(placeholders, "1"))
        try:
            skill_names = [call.name for call in read_calls(example.text or template)]
        except SkillError as error:
            text = f"the skill string of '{action}' is wrong: {error.message}"
            mistakes.append(agent.config.error(f"{_mapping_path(agent)}/{action}", text))
            continue
        for name in skill_names:
            if skills is not None and name not in skills:
                text = f"'{action}' is mapped to the skill '{name}', which does not exist"
                unknown_skill = _make_mapping_mistake(agent, action, text, name, skills)
                mistakes.append(unknown_skill)
    # the hint appears once, at the last mistake: the user may only lack the robot's skills
    if unknown_skill is not None and agent.known_skills:
        full_stop = "" if (unknown_skill.hint or "").endswith("?") else "."
        unknown_skill.hint = (
            f"{unknown_skill.hint}{full_stop} Without the robot, --skiller simulator executes any skill"
        )
    return mistakes


def known_skills(agent: Run) -> frozenset[str] | None:
    """Return the skills available to the action mapping; None if another process has them.

    None, too, if a Skiller accepts any skill.
    """
    board, skills_by_skiller = agent.skill_board, agent.known_skills
    are_elsewhere = not skills_by_skiller if board is None else not board.in_process
    if are_elsewhere or None in skills_by_skiller.values():
        return None
    executors = (
        executor
        for board_agent in (() if board is None else board.agents)
        for executor in board_agent.executors
    )
    return frozenset().union(
        *(names or () for names in skills_by_skiller.values()),
        *(executor.skills() for executor in executors),
    )


def _mapping_path(agent: Run) -> str:
    return f"/clips-executive/specs/{agent.spec}/action-mapping"


def _make_mapping_mistake(
    agent: Run, action: str, message: str, unknown_name: str, known_names: Iterable[str]
) -> ConfigError:
    """Return the error about an unknown name in the mapping of an action.

    :param unknown_name: the unknown parameter or skill.
    :param known_names: the known parameters or skills.
    """
    known_names = sorted(known_names)
    hint = did_you_mean(unknown_name, known_names, f"there are: {', '.join(known_names) or 'none'}")
    return agent.config.error(f"{_mapping_path(agent)}/{action}", message, hint)


# -- while the agent runs


def own_files(agent: Run, executive: Executive) -> list[Path]:
    """Return the loaded files of an agent without the files of the core."""
    paths = agent.paths
    core_dirs = (paths.core_dir, paths.library_dir, *paths.override_dirs)
    return [
        file
        for file in dict.fromkeys(executive.env.loader.files)
        if not any(file.is_relative_to(folder) for folder in core_dirs)
    ]


class UnexecutedActions:
    """Logs each action that fails because no rule executes it, once, with the place of the mistake.

    A monitor sets such an action to FAILED: the rule of ``execmon/stalled-action.clp``, or an agent's own.
    """

    def __init__(self, agent: Run, executive: Executive) -> None:
        self._agent, self._executive = agent, executive
        self._reported_actions: set[str] = set()
        slots = ("action-name", "state", "error-msg", "executable")
        executive.env.watcher.follow("plan-action", self._record_fact, slots)

    def _record_fact(self, _template: str, slots: Mapping[str, str]) -> None:
        if slots.get("state") != "FAILED" or _NO_EXECUTOR not in slots.get("error-msg", ""):
            return
        action = slots["action-name"]
        if action not in self._reported_actions:
            self._reported_actions.add(action)
            self._executive.log.error(self._describe_mistake(action, slots["executable"] == "TRUE"))

    def _describe_mistake(self, action: str, is_executable: bool) -> str:
        """Return a text about the cause.

        It is a misspelt or unmapped action, a precondition, or missing control of the Skiller.
        """
        config = self._agent.config
        place = place_of_action(own_files(self._agent, self._executive), action)
        operators = {str(slots["name"]) for _, _, slots in self._executive.env.facts("domain-operator")}
        mapped_actions = set(read_action_mapping(config, self._agent.spec))
        if action not in operators:
            text = f"the action '{action}' has no executor"
            hint = did_you_mean(action, operators & mapped_actions or operators | mapped_actions)
        elif action in mapped_actions and not is_executable:
            text = f"the precondition of '{action}' is false, and a monitor fails actions that wait for it"
            hint = ""
        elif action in mapped_actions:
            text = f"'{action}' found no Skiller under control, and a monitor fails actions that wait for it"
            hint = ""
        else:
            text = f"the action mapping lacks the action '{action}'"
            similar = nearest_names(action, mapped_actions - operators)
            hint = f"is '{similar[0]}' meant for it?" if similar else ""
            path = _mapping_path(self._agent)
            values = [config.get(f"{path}/{similar[0]}")] if similar else config.search(path)
            place = next((value.location for value in values if value.location), place)
        return (f"{place}: " if place else "") + text + (f"; {hint}" if hint else "")
