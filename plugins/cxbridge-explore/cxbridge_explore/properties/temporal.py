"""Temporal properties of patterns: ``never``, ``always``, ``eventually`` and ``after``.

``always`` matches its pattern after each loop. The other properties match a pattern without ``not`` and
``forall`` at each moment, even between two firings of rules. A pattern with ``not`` or ``forall`` requires
the absence of facts, and is matched after each loop only: a rule that modifies a fact retracts the fact for a
moment, which is not an absence.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene
from cxbridge_explore.properties.patterns import BoundValues, ConditionPattern, Probe, check_templates
from cxbridge_explore.properties.tables import FactTables


@dataclass(frozen=True, slots=True)
class _WatchedPattern:
    """A pattern of a property.

    :param variables: the variables whose values distinguish the matches.
    :param on_match: called at each match, unless the pattern requires an absence; None to call nothing.
    """

    pattern: ConditionPattern
    variables: tuple[str, ...] = ()
    on_match: Callable[[FactTables, BoundValues], None] | None = None

    def make_probe(self, tables: FactTables) -> Probe:
        """Make the probe that finds the matches of the pattern in an agent."""
        probe = Probe(tables.env, self.pattern, self.variables)
        if self.on_match is not None and not self.pattern.requires_absence:
            probe.follow_matches(partial(self.on_match, tables))
        return probe


class PatternMonitor(Monitor):
    """The base class of these monitors: makes the probes in each agent as soon as its deftemplates exist.

    The deftemplates exist when the agent is loaded, some loops after the start of the run; a deftemplate that
    is missing then is an error. The run may have several agents.
    """

    def __init__(self, scene: Scene, *patterns: _WatchedPattern) -> None:
        self.templates = tuple(
            dict.fromkeys(name for watched in patterns for name in watched.pattern.templates)
        )
        super().__init__(scene)
        self._patterns = patterns
        self._loading_tables: list[FactTables] = []
        self.probes: dict[FactTables, list[Probe]] = {}  # by agent, in the order of the patterns

    def joined(self, tables: FactTables) -> None:
        super().joined(tables)
        self._loading_tables.append(tables)

    def left(self, tables: FactTables) -> None:
        self.probes.pop(tables, None)
        self._loading_tables = [loading for loading in self._loading_tables if loading is not tables]

    def check(self) -> None:
        for tables in list(self._loading_tables):
            # a loaded agent gets no further deftemplates: `check_templates` reports those that it lacks
            if all(map(tables.env.has_template, self.templates)) or tables.is_initialized:
                for watched in self._patterns:
                    check_templates(watched.pattern, tables.env)
                self._loading_tables.remove(tables)
                self.probes[tables] = [watched.make_probe(tables) for watched in self._patterns]
        if not self._loading_tables:
            self.check_patterns()

    @abstractmethod
    def check_patterns(self) -> None:
        """Check the run after a loop; each agent has its probes."""

    def find_current_matches(self) -> list[tuple[FactTables, set[BoundValues]]]:
        """Return the current matches of the first pattern in each agent."""
        return [(tables, probe.find_matches()) for tables, (probe, *_) in self.probes.items()]


class NeverMonitor(PatternMonitor):
    """Checks that a pattern never matches."""

    def __init__(self, scene: Scene, pattern: ConditionPattern) -> None:
        super().__init__(scene, _WatchedPattern(pattern, pattern.variables, self._handle_match))
        self._pattern = pattern

    def check_patterns(self) -> None:
        if not self.changes.take_pending():
            return
        if not self._pattern.requires_absence:
            self.is_evaluated = self.is_evaluated or self._has_facts()
            return
        self.is_evaluated = True
        for tables, current_matches in self.find_current_matches():
            for values in current_matches:
                self._handle_match(tables, values)

    def _has_facts(self) -> bool:
        """Return whether an agent has a fact of each deftemplate of the pattern."""
        return any(
            all(next(tables.env.facts(name), None) for name in self.templates) for tables in self.probes
        )

    def _handle_match(self, _tables: FactTables, values: BoundValues) -> None:
        self.scene.report(f"{self._pattern.text} matches{_format_bindings(self._pattern.variables, values)}")


class AlwaysMonitor(PatternMonitor):
    """Checks that a pattern matches after each loop in each agent, as soon as the agents are initialised."""

    def __init__(self, scene: Scene, pattern: ConditionPattern) -> None:
        super().__init__(scene, _WatchedPattern(pattern))
        self._pattern = pattern

    def check_patterns(self) -> None:
        if not self.is_evaluated and not all(tables.is_initialized for tables in self.probes):
            return
        if not self.changes.take_pending() and self.is_evaluated:
            return
        self.is_evaluated = True
        for tables, current_matches in self.find_current_matches():
            if not current_matches:
                agent = f" in {tables.name}" if len(self.probes) > 1 else ""
                self.scene.report(f"{self._pattern.text} does not match{agent}")

    def state(self) -> Hashable:
        """Return whether the check has begun."""
        return self.is_evaluated


class EventuallyMonitor(PatternMonitor):
    """Checks that a pattern matches at some moment in some agent.

    :param within_s: the time limit since the start of the run; None for the end of the run.
    """

    def __init__(self, scene: Scene, pattern: ConditionPattern, within_s: float | None) -> None:
        super().__init__(scene, _WatchedPattern(pattern, on_match=self._handle_match))
        self._pattern = pattern
        self._within_s = within_s
        self._has_matched = False

    def _handle_match(self, _tables: FactTables, _values: BoundValues) -> None:
        self._has_matched = True

    def check_patterns(self) -> None:
        self.is_evaluated = True
        if self._pattern.requires_absence and self.changes.take_pending():
            self._has_matched = self._has_matched or any(
                current_matches for _, current_matches in self.find_current_matches()
            )
        if self._within_s is not None and not self._has_matched and self.scene.seconds > self._within_s:
            self.scene.report(f"{self._pattern.text} has not matched within {self._within_s:g} s")

    def check_end(self, end: RunEnd) -> None:
        """Report a missing match, unless the run was cut before the limit."""
        if not self._has_matched and (end.ending is not Ending.CUT or self._within_s is None):
            self.scene.report(f"{self._pattern.text} has never matched")

    def state(self) -> Hashable:
        """Return True after a match; before it, the remaining seconds, or False without a time limit."""
        if self._has_matched or self._within_s is None:
            return self._has_matched
        return round(self._within_s - self.scene.seconds, 3)


class AfterMonitor(PatternMonitor):
    """Checks that after each match of a first pattern, a second pattern matches at the same time or later.

    Variables with one name have equal values in both patterns. A modified fact that still matches is a new
    match.

    :param within_s: the time limit since the match of the first pattern; None for the end of the run.
    """

    def __init__(
        self,
        scene: Scene,
        first_pattern: ConditionPattern,
        second_pattern: ConditionPattern,
        within_s: float | None,
    ) -> None:
        self._shared_variables = tuple(
            name for name in first_pattern.variables if name in second_pattern.variables
        )
        super().__init__(
            scene,
            _WatchedPattern(first_pattern, self._shared_variables, self._handle_first_match),
            _WatchedPattern(second_pattern, self._shared_variables, self._handle_second_match),
        )
        self._first_pattern, self._second_pattern = first_pattern, second_pattern
        self._within_s = within_s
        # By agent and shared values: the seconds of each first match that still lacks a second match.
        self._open_obligations: dict[tuple[str, BoundValues], float] = {}
        self._newly_matched_agents: set[str] = set()  # agents in which the first pattern matched in this loop
        # by agent, for a first pattern with an absence
        self._earlier_matches: dict[str, set[BoundValues]] = {}

    def left(self, tables: FactTables) -> None:
        super().left(tables)
        self._earlier_matches.pop(tables.name, None)
        self._newly_matched_agents.discard(tables.name)
        self._open_obligations = {
            (agent, values): begin_s
            for (agent, values), begin_s in self._open_obligations.items()
            if agent != tables.name
        }

    def _handle_first_match(self, tables: FactTables, values: BoundValues) -> None:
        self.is_evaluated = True
        self._open_obligations.setdefault((tables.name, values), self.scene.seconds)
        self._newly_matched_agents.add(tables.name)

    def _handle_second_match(self, tables: FactTables, values: BoundValues) -> None:
        self._open_obligations.pop((tables.name, values), None)

    def check_patterns(self) -> None:
        """Check new matches and deadlines after a loop."""
        has_changed = self.changes.take_pending()
        if self._first_pattern.requires_absence and has_changed:
            for tables, current_matches in self.find_current_matches():
                for values in current_matches - self._earlier_matches.get(tables.name, set()):
                    self._handle_first_match(tables, values)
                self._earlier_matches[tables.name] = current_matches
        for tables, (_, second_probe) in self.probes.items():
            # checked here, since no match is reported if the second pattern has matched before the first
            if tables.name in self._newly_matched_agents or (
                has_changed and self._second_pattern.requires_absence
            ):
                for values in second_probe.find_matches():
                    self._handle_second_match(tables, values)
        self._newly_matched_agents.clear()
        if self._within_s is not None:
            for (_, values), begin_s in self._open_obligations.items():
                if self.scene.seconds - begin_s > self._within_s:
                    self._report(values, f"within {self._within_s:g} s")

    def check_end(self, end: RunEnd) -> None:
        """Report open obligations, unless the run was cut before the limit."""
        if end.ending is not Ending.CUT or self._within_s is None:
            for _, values in self._open_obligations:
                self._report(values, "until the end")

    def _report(self, values: BoundValues, limit_text: str) -> None:
        bindings = _format_bindings(self._shared_variables, values)
        self.scene.report(
            f"{self._second_pattern.text} has not matched {limit_text}, "
            f"after {self._first_pattern.text}{bindings}"
        )

    def state(self) -> Hashable:
        """Return the open obligations with their times."""
        obligations: list[tuple[object, ...]] = [(agent, *values) for agent, values in self._open_obligations]
        if self._within_s is not None:
            now_s = self.scene.seconds
            obligations = [
                (*key, round(now_s - begin_s, 3)) for key, begin_s in self._open_obligations.items()
            ]
        earlier_matches = tuple(
            (name, frozenset(matches)) for name, matches in sorted(self._earlier_matches.items())
        )
        return frozenset(obligations), earlier_matches


def _format_bindings(variables: tuple[str, ...], values: BoundValues) -> str:
    """Return the values of variables as the last part of a message."""
    text = ", ".join(f"{name} = {value}" for name, value in zip(variables, values, strict=True))
    return f": {text}" if text else ""
