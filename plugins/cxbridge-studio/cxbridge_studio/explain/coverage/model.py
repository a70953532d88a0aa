"""The coverage of an agent by recorded runs: rules, goal classes and their modes, actions, skills.

:class:`AgentSources` has the names that the agent's files define, :class:`RecordedUse` the names that the
runs have used; :func:`compute_coverage` compares them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, definitions
from cxbridge.events import GoalTransition, PlanActionTransition, RuleFired, SkillStatus, SourceRead
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import RunSource, run_sources
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.agent.pddl import read_pddl
from cxbridge_studio.environment_sources import find_build_sources, make_unknown_environment_error
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

# The start of a skill string, `NAME{...}`.
_SKILL_NAME = re.compile(r"\s*([A-Za-z_][\w-]*)")
# Rules that fire in each loop, so recordings omit their firings.
_LOOP_RULES: Final = ("time-retract", "blackboard-read")
# A class in a pattern or in an action; not a variable, a number or a connective such as `&` and `|`.
_CLASS_NAME = re.compile(r"[A-Za-z][\w-]*\Z")


@dataclass(frozen=True, slots=True)
class RuleLines:
    """A defrule and its lines.

    :param lines: the numbers of the lines with code; the first is the line on which the defrule begins.
    """

    name: str
    file: str
    lines: tuple[int, ...]


@dataclass(slots=True)
class AgentSources:
    """The names in an agent's sources.

    :ivar rules: the rules by name; of two rules with the same name, the last definition.
    :ivar goal_classes: the goal classes that constructs name.
    :ivar operators: the operators of the PDDL domains, in lower case.
    :ivar texts: the texts of the CLIPS files, by name.
    """

    rules: dict[str, RuleLines] = field(default_factory=dict)
    goal_classes: set[str] = field(default_factory=set)
    operators: set[str] = field(default_factory=set)
    texts: dict[str, str] = field(default_factory=dict)

    def add_file(self, file: TextFile) -> None:
        """Add the names of a CLIPS file. Of two versions of a file, only the rules of the later count."""
        previous_text = self.texts.get(file.name)
        if previous_text == file.text:
            return
        if previous_text is not None:
            self.rules = {name: rule for name, rule in self.rules.items() if rule.file != file.name}
        self.texts[file.name] = file.text
        for definition in definitions(file.text):
            if definition.kind == "defrule":
                # the lines with more than blanks and comments
                lines = tuple(
                    number
                    for number, line in enumerate(definition.node.text.split("\n"), definition.line)
                    if line.strip() and not line.lstrip().startswith(";")
                )
                self.rules[definition.name] = RuleLines(definition.name, file.name, lines)
            self.goal_classes.update(_find_goal_class_names(definition.node))

    def add_source(self, source: RunSource | SourceRead, *, include_core: bool) -> None:
        """Add the names of a CLIPS file or a PDDL domain; ignore other sources, and sources without data.

        :param include_core: whether to include the built-in core.
        """
        if source.data is None:
            return
        text = source.data.decode("utf-8", "surrogateescape")
        # This tells the core's files from the agent's: only the built-in core relies on the `modify` of CLIPS
        # 6.4. A file that CLIPS loads without the host has that `modify`, too, and counts as the core's.
        if source.role == "clips" and (include_core or source.details.get("modify") != "6.4"):
            self.add_file(TextFile(source.name, text))
        elif source.role == "pddl" and source.details.get("kind") == "domain":
            self.add_domain(text)

    def add_domain(self, text: str) -> None:
        """Add the operators of a PDDL domain."""
        self.operators.update(
            mention.name.text.lower()
            for mention in read_pddl("", text).mentions
            if mention.name.kind is NameKind.ACTION and mention.use is Use.DEFINED
        )


def _find_goal_class_names(construct: SyntaxNode) -> Iterable[str]:
    """Yield the goal classes that a construct names."""
    return (
        word.text
        for node in construct.walk()
        if node.head == "goal"
        for slot in node.arguments
        if slot.head == "class"
        for previous, word in pairwise(slot.items or ())
        # A class after `~` is excluded, not named.
        if _CLASS_NAME.match(word.text) and previous.text != "~"
    )


@dataclass(slots=True)
class RecordedUse:
    """The parts of an agent that runs have used.

    :ivar run_count: the number of runs.
    :ivar firings: the number of firings by rule.
    :ivar modes: the number of goals by class and mode.
    :ivar outcomes: the number of goals by class and outcome.
    :ivar actions: the number of executions by action.
    :ivar skills: the number of executions by skill.
    :ivar runs_without_firings: the paths of the runs without recorded firings.
    :ivar notes: the notes of the runs' recordings, each after the path of its run.
    """

    run_count: int = 0
    firings: Counter[str] = field(default_factory=Counter)
    modes: dict[str, Counter[str]] = field(default_factory=dict)
    outcomes: dict[str, Counter[str]] = field(default_factory=dict)
    actions: Counter[str] = field(default_factory=Counter)
    skills: Counter[str] = field(default_factory=Counter)
    runs_without_firings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, run: Run, env: str) -> None:
        """Add the used parts of a run.

        :param env: the CLIPS environment whose events count.
        :raises TraceError: if the recording has no such environment.
        """
        self.run_count += 1
        firings_before = self.firings.total()
        last_modes: dict[str, str] = {}
        last_statuses: dict[str, tuple[str, str]] = {}  # the skill string and the status by Skiller
        envs = {source.name for source in run_sources(run, "environment")}
        for event in run:
            event_env = getattr(event, "env", "")
            envs.update({event_env} - {""})
            if event_env != env:
                continue
            match event:
                case RuleFired():
                    self.firings[event.rule] += 1
                case GoalTransition():
                    self._count_goal(event, last_modes)
                case PlanActionTransition(state="RUNNING"):
                    self.actions[event.action.lower()] += 1
                case SkillStatus():
                    status = event.skill_string, event.status
                    # A Skiller reports its status again with each change of another field.
                    if event.status == "S_RUNNING" and last_statuses.get(event.skiller) != status:
                        match = _SKILL_NAME.match(event.skill_string)
                        self.skills[match[1] if match else event.skill_string] += 1
                    last_statuses[event.skiller] = status
        if envs and env not in envs:
            raise make_unknown_environment_error(env, envs, run.path)
        # A run of an agent fires rules, so a recording without firings has not recorded them.
        if self.firings.total() == firings_before:
            self.runs_without_firings.append(str(run.path))
        self.notes += [f"{run.path}: {note}" for note in run.notes]

    def _count_goal(self, event: GoalTransition, last_modes: dict[str, str]) -> None:
        """Count the new mode of a goal; a transition that repeats the mode changes another slot."""
        if last_modes.get(event.goal) == event.mode:
            return
        last_modes[event.goal] = event.mode
        self.modes.setdefault(event.goal_class, Counter())[event.mode] += 1
        if event.mode == "FINISHED":
            self.outcomes.setdefault(event.goal_class, Counter())[event.outcome] += 1


def add_recorded_agent(agent: AgentSources, run: Run, env: str, *, include_core: bool) -> bool:
    """Add the recorded files to an agent, and return whether the recording has CLIPS files.

    :param include_core: whether to include the built-in core.
    """
    clips_sources = [
        source
        for source in find_build_sources(run, env)
        if source.role == "clips" and source.data is not None
    ]
    for source in (*clips_sources, *run_sources(run, "pddl")):
        agent.add_source(source, include_core=include_core)
    return bool(clips_sources)


@dataclass(frozen=True, slots=True)
class FileCoverage:
    """The coverage of a file.

    :param rules: each rule with its number of firings; None if firings are not recorded.
    """

    file: str
    rules: tuple[tuple[RuleLines, int | None], ...]

    @property
    def watched_count(self) -> int:
        """The number of rules whose firings are recorded."""
        return sum(count is not None for _, count in self.rules)

    @property
    def fired_count(self) -> int:
        """The number of rules that fired."""
        return sum(bool(count) for _, count in self.rules)


@dataclass(frozen=True, slots=True)
class NameCoverage:
    """Used and unused names of one kind.

    :param used: names with their number of uses.
    """

    used: tuple[tuple[str, int], ...]
    unused: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """The used and unused parts of an agent.

    :param outcomes: for each goal class in the runs, the number of goals by outcome.
    :param missing_modes: the goal classes in the runs, each with the modes that no goal reached; without the
        classes that reached all modes.
    """

    run_count: int
    files: tuple[FileCoverage, ...]
    goal_classes: NameCoverage
    missing_modes: tuple[tuple[str, tuple[str, ...]], ...]
    outcomes: tuple[tuple[str, tuple[tuple[str, int], ...]], ...]
    actions: NameCoverage
    skills: NameCoverage
    notes: tuple[str, ...]

    @property
    def watched_count(self) -> int:
        """The number of rules whose firings are recorded."""
        return sum(file.watched_count for file in self.files)

    @property
    def fired_count(self) -> int:
        """The number of rules that fired."""
        return sum(file.fired_count for file in self.files)

    @property
    def percent(self) -> float:
        """The percentage of fired rules among those whose firings are recorded; 100 if there are none."""
        return 100.0 * self.fired_count / self.watched_count if self.watched_count else 100.0


def compute_coverage(agent: AgentSources, recorded_use: RecordedUse, globs: tuple[str, ...] = ()) -> Coverage:
    """Compare the names that an agent defines with those that runs have used.

    :param globs: the patterns of paths or names of the files to include; empty for all files.
    """
    counts_by_file: dict[str, list[tuple[RuleLines, int | None]]] = {}
    for rule in agent.rules.values():
        names = rule.file, Path(rule.file).name
        if not globs or any(fnmatchcase(name, glob) for name in names for glob in globs):
            firings = recorded_use.firings.get(rule.name, 0)
            # An unwatched rule without recorded firings may have fired.
            count = None if not firings and rule.name in _LOOP_RULES else firings
            counts_by_file.setdefault(rule.file, []).append((rule, count))
    files = tuple(
        # In the order of the file: each pair has the rule and its number of firings.
        FileCoverage(file, tuple(sorted(rule_counts, key=lambda pair: pair[0].lines[0])))
        for file, rule_counts in sorted(counts_by_file.items())
    )
    missing_modes = {
        name: tuple(mode for mode in MODES if not counts[mode])
        for name, counts in sorted(recorded_use.modes.items())
    }
    return Coverage(
        recorded_use.run_count,
        files,
        # A class whose goals were all formulated before the recording began counts once.
        _compare_names(
            {name: counts["FORMULATED"] or 1 for name, counts in recorded_use.modes.items()},
            agent.goal_classes,
        ),
        tuple((name, modes) for name, modes in missing_modes.items() if modes),
        tuple(
            (name, tuple(sorted(counts.items()))) for name, counts in sorted(recorded_use.outcomes.items())
        ),
        _compare_names(recorded_use.actions, agent.operators),
        _compare_names(recorded_use.skills, ()),
        (
            *recorded_use.notes,
            *(f"{run}: no firings recorded (level rules)" for run in recorded_use.runs_without_firings),
        ),
    )


def _compare_names(use_counts: dict[str, int], defined_names: Iterable[str]) -> NameCoverage:
    """Return the used names, and the defined names without a use."""
    return NameCoverage(
        tuple(sorted(use_counts.items())), tuple(sorted(set(defined_names) - use_counts.keys()))
    )
