"""The coverage of an agent by recorded runs: rules, goal classes and their modes, actions, skills.

:class:`AgentSources` has the names that the agent's files define, :class:`RecordedUse` the names that the
runs have used; :func:`coverage_of` compares the two.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, definitions
from cxbridge.errors import TraceError
from cxbridge.events import GoalTransition, PlanActionTransition, RuleFired, SkillStatus, SourceRead
from cxbridge.suggestions import did_you_mean
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import RunSource, building_steps, sources_of
from cxbridge_studio.explain.rules.constructs import TextFile

# The modes of a goal, in the order of its life.
MODES: Final = (
    "FORMULATED",
    "SELECTED",
    "EXPANDED",
    "COMMITTED",
    "DISPATCHED",
    "FINISHED",
    "EVALUATED",
    "RETRACTED",
)

_OPERATOR = re.compile(r"\(\s*:(?:durative-)?action\s+([^\s()]+)", re.IGNORECASE)
_COMMENT = re.compile(r";[^\n]*")
_SKILL_NAME = re.compile(r"\s*([A-Za-z_][\w-]*)")
_UNWATCHED = "/clips-executive/debug/unwatch-rules"
# Rules that fire in each loop; their firings are never recorded.
_EVERY_TICK: Final = ("time-retract", "blackboard-read")
_PLAIN_WORD = re.compile(r"[A-Za-z][\w-]*\Z")


@dataclass(frozen=True, slots=True)
class RuleLines:
    """A defrule and its lines.

    :param lines: the numbers of lines with code; the first is the line of the name.
    """

    name: str
    file: str
    lines: tuple[int, ...]


@dataclass(slots=True)
class AgentSources:
    """The names in an agent's sources.

    :ivar rules: the rules by name; of two rules with the same name, the last definition.
    :ivar classes: the goal classes.
    :ivar operators: the operators of the PDDL domains, in lower case.
    :ivar unwatched: the rules whose firings are not recorded.
    :ivar changed: the files that differ between runs.
    :ivar texts: the texts of the CLIPS files, by name.
    """

    rules: dict[str, RuleLines] = field(default_factory=dict)
    classes: set[str] = field(default_factory=set)
    operators: set[str] = field(default_factory=set)
    unwatched: set[str] = field(default_factory=set)
    changed: set[str] = field(default_factory=set)
    texts: dict[str, str] = field(default_factory=dict)

    def add_file(self, file: TextFile) -> None:
        previous_text = self.texts.get(file.name)
        if previous_text == file.text:
            return
        if previous_text is not None:
            self.changed.add(file.name)
            self.rules = {name: rule for name, rule in self.rules.items() if rule.file != file.name}
        self.texts[file.name] = file.text
        for definition in definitions(file.text):
            if definition.kind == "defrule":
                lines = tuple(_code_lines(definition.node.text, definition.line))
                self.rules[definition.name] = RuleLines(definition.name, file.name, lines)
            self.classes.update(_classes(definition.node))

    def add_source(self, source: RunSource | SourceRead, *, core: bool) -> None:
        """Add the sources of a run.

        :param core: whether to include the built-in core.
        """
        if (data := source.data) is None:
            return
        text = data.decode("utf-8", "surrogateescape")
        # Only the built-in core is written for 6.4's modify, which tells its files from the agent's.
        if source.role == "clips" and (core or source.details.get("modify") != "6.4"):
            self.add_file(TextFile(source.name, text))
        elif source.role == "pddl" and source.details.get("kind") == "domain":
            self.add_domain(text)
        elif source.role == "config-tree":
            self.unwatched.update(_EVERY_TICK)
            self.unwatched.update(_unwatched_rules(text))

    def add_domain(self, text: str) -> None:
        self.operators.update(match[1].lower() for match in _OPERATOR.finditer(_COMMENT.sub("", text)))


def _code_lines(text: str, first: int) -> Iterable[int]:
    """Yield the numbers of lines with more than blanks and comments."""
    for number, line in enumerate(text.split("\n"), first):
        if line.strip() and not line.lstrip().startswith(";"):
            yield number


def _classes(construct: SyntaxNode) -> Iterable[str]:
    """Yield the goal classes that a construct names."""
    for node in construct.walk():
        slots = node.arguments if node.head == "goal" else ()
        for slot in slots:
            if slot.items is not None and slot.head == "class":
                for previous, word in pairwise(slot.items):
                    if _PLAIN_WORD.match(word.text) and previous.text != "~":
                        yield word.text


@dataclass(slots=True)
class RecordedUse:
    """The parts of an agent that runs have used.

    :ivar firings: the number of firings by rule.
    :ivar modes: the number of goals by class and mode.
    :ivar outcomes: the number of goals by class and outcome.
    :ivar actions: the number of executions by action.
    :ivar skills: the number of executions by skill.
    :ivar without_firings: the runs without recorded firings.
    """

    runs: int = 0
    firings: Counter[str] = field(default_factory=Counter)
    modes: dict[str, Counter[str]] = field(default_factory=dict)
    outcomes: dict[str, Counter[str]] = field(default_factory=dict)
    actions: Counter[str] = field(default_factory=Counter)
    skills: Counter[str] = field(default_factory=Counter)
    without_firings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, run: Run, env: str) -> None:
        """Add the used parts of a run."""
        self.runs += 1
        firings_before = self.firings.total()
        last_mode: dict[str, str] = {}
        last_status: dict[str, tuple[str, str]] = {}  # skill string and status by Skiller
        envs = {source.name for source in sources_of(run, "environment")}
        for event in run:
            if name := getattr(event, "env", ""):
                envs.add(name)
            if isinstance(event, RuleFired) and event.env == env:
                self.firings[event.rule] += 1
            elif isinstance(event, GoalTransition) and event.env == env:
                self._count_goal(event, last_mode)
            elif isinstance(event, PlanActionTransition) and event.env == env:
                if event.state == "RUNNING":
                    self.actions[event.action.lower()] += 1
            elif isinstance(event, SkillStatus) and event.env == env:
                status = event.skill_string, event.status
                # A Skiller repeats its status with each change of other fields.
                if event.status == "S_RUNNING" and last_status.get(event.skiller) != status:
                    match = _SKILL_NAME.match(event.skill_string)
                    self.skills[match[1] if match else event.skill_string] += 1
                last_status[event.skiller] = status
        check_environment(env, envs, run.path)
        if self.firings.total() == firings_before:
            self.without_firings.append(str(run.path))
        self.notes += [f"{run.path}: {note}" for note in run.notes]

    def _count_goal(self, event: GoalTransition, last_mode: dict[str, str]) -> None:
        """Count a goal's new mode: a transition that repeats the mode changes another slot."""
        if last_mode.get(event.goal) == event.mode:
            return
        last_mode[event.goal] = event.mode
        self.modes.setdefault(event.goal_class, Counter())[event.mode] += 1
        if event.mode == "FINISHED":
            self.outcomes.setdefault(event.goal_class, Counter())[event.outcome] += 1


def check_environment(env: str, names: Collection[str], path: Path) -> None:
    """Check that a recording has a CLIPS environment of this name. A recording without environments passes.

    :raises TraceError: if the recording has other environments only.
    """
    if names and env not in names:
        hint = did_you_mean(env, names, f"there are: {', '.join(sorted(names))}")
        raise TraceError(f"there is no CLIPS environment '{env}' in it", file=path, hint=hint)


def add_recorded_agent(agent: AgentSources, run: Run, env: str, *, core: bool) -> bool:
    """Add the recorded files to an agent and return whether the recording has CLIPS files.

    :param core: whether to include the built-in core.
    """
    steps = [step for step in building_steps(run, env) if step.role == "clips" and step.data is not None]
    for source in (*steps, *sources_of(run, "pddl", "config-tree")):
        agent.add_source(source, core=core)
    return bool(steps)


def _unwatched_rules(tree: str) -> list[str]:
    """Return the rules that a recorded configuration does not watch; empty if it is not readable."""
    try:
        names = json.loads(tree).get(_UNWATCHED, [])
    except (ValueError, AttributeError, RecursionError):
        return []
    names = [names] if isinstance(names, str) else names
    return list(map(str, names)) if isinstance(names, list) else []


@dataclass(frozen=True, slots=True)
class FileCoverage:
    """The coverage of a file.

    :param rules: each rule with its number of firings; None if firings are not recorded.
    """

    file: str
    rules: tuple[tuple[RuleLines, int | None], ...]

    @property
    def counted(self) -> int:
        """The number of rules with recorded firings."""
        return sum(count is not None for _, count in self.rules)

    @property
    def fired(self) -> int:
        """The number of rules that fired."""
        return sum(bool(count) for _, count in self.rules)


@dataclass(frozen=True, slots=True)
class UsedNames:
    """Used and unused names of one kind.

    :param used: names with their number of uses.
    """

    used: tuple[tuple[str, int], ...]
    unused: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """The used and unused parts of an agent.

    :param missing_modes: for each goal class in the runs, the modes that no goal reached.
    """

    runs: int
    files: tuple[FileCoverage, ...]
    classes: UsedNames
    missing_modes: tuple[tuple[str, tuple[str, ...]], ...]
    outcomes: tuple[tuple[str, tuple[tuple[str, int], ...]], ...]
    actions: UsedNames
    skills: UsedNames
    notes: tuple[str, ...]

    @property
    def counted(self) -> int:
        """The number of rules with recorded firings."""
        return sum(file.counted for file in self.files)

    @property
    def fired(self) -> int:
        """The number of rules that fired."""
        return sum(file.fired for file in self.files)

    @property
    def percent(self) -> float:
        """Percentage of rules that fired; 100 for an agent without rules."""
        return 100.0 * self.fired / self.counted if self.counted else 100.0


def coverage_of(agent: AgentSources, use: RecordedUse, globs: tuple[str, ...] = ()) -> Coverage:
    """Combine an agent and the uses of its parts.

    :param globs: include only the rules of files whose path or name matches one of these patterns;
        empty for all.
    """
    by_file: dict[str, list[tuple[RuleLines, int | None]]] = {}
    for rule in agent.rules.values():
        if not globs or _matches(rule.file, globs):
            firings = use.firings.get(rule.name, 0)
            # An unwatched rule without recorded firings may have fired.
            count = None if not firings and rule.name in agent.unwatched else firings
            by_file.setdefault(rule.file, []).append((rule, count))
    files = tuple(
        FileCoverage(file, tuple(sorted(rules, key=lambda item: item[0].lines[0])))
        for file, rules in sorted(by_file.items())
    )
    notes = [f"{file} was not the same in all runs; the last counts" for file in sorted(agent.changed)]
    notes += [f"{run}: no firings recorded (level rules)" for run in use.without_firings]
    return Coverage(
        use.runs,
        files,
        # A goal that was formulated before the recording began counts once.
        _used_names({name: use.modes[name]["FORMULATED"] or 1 for name in use.modes}, agent.classes),
        tuple(
            (name, tuple(mode for mode in MODES if not use.modes[name][mode]))
            for name in sorted(use.modes)
            if any(not use.modes[name][mode] for mode in MODES)
        ),
        tuple((name, tuple(sorted(counts.items()))) for name, counts in sorted(use.outcomes.items())),
        _used_names(use.actions, agent.operators),
        _used_names(use.skills, ()),
        (*use.notes, *notes),
    )


def _used_names(used: dict[str, int], defined: Iterable[str]) -> UsedNames:
    return UsedNames(tuple(sorted(used.items())), tuple(sorted(set(defined) - used.keys())))


def _matches(file: str, globs: tuple[str, ...]) -> bool:
    return any(fnmatchcase(file, glob) or fnmatchcase(Path(file).name, glob) for glob in globs)
