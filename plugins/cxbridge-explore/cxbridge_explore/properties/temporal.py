"""Temporal properties of patterns: never, always, eventually, after."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Hashable
from functools import partial

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene
from cxbridge_explore.properties.patterns import ConditionPattern, Probe, Values, check_names
from cxbridge_explore.properties.tables import Changes, FactTables


class PatternMonitor(Monitor):
    """Base class: defines the probes in each agent as soon as its deftemplates exist."""

    def __init__(self, scene: Scene, *patterns: ConditionPattern) -> None:
        super().__init__(scene)
        self._patterns = patterns
        self._waiting: list[FactTables] = []

    def begin(self) -> None:
        self.changes = Changes(*{name for pattern in self._patterns for name in pattern.templates})

    def joined(self, tables: FactTables) -> None:
        self._waiting.append(tables)
        self.changes.follow(tables)

    def left(self, tables: FactTables) -> None:
        if tables in self._waiting:
            self._waiting.remove(tables)
        else:
            self.forget(tables)

    def look(self) -> None:
        for tables in list(self._waiting):
            env = tables.env
            ready = all(env.has_template(name) for each in self._patterns for name in each.templates)
            loaded = next(env.facts("executive-initialized"), None) is not None
            if ready or loaded:
                for pattern in self._patterns:
                    check_names(pattern, env)
                self._waiting.remove(tables)
                self.probe(tables)
        if not self._waiting:
            self.check()

    @abstractmethod
    def probe(self, tables: FactTables) -> None:
        """Define the probes in an agent."""

    @abstractmethod
    def forget(self, tables: FactTables) -> None:
        """Forget the probes of an agent."""

    @abstractmethod
    def check(self) -> None:
        """Check the run after a loop; all agents are loaded."""

    def had_facts(self) -> bool:
        return any(
            all(next(tables.env.facts(name), None) for each in self._patterns for name in each.templates)
            for tables in self.scene.tables
        )


class Never(PatternMonitor):
    """A pattern never matches.

    Patterns without ``not`` and ``forall`` are matched at each moment, patterns with them after each loop.
    """

    def __init__(self, scene: Scene, pattern: ConditionPattern) -> None:
        super().__init__(scene, pattern)
        self._pattern = pattern
        self._probes: dict[FactTables, Probe] = {}

    def probe(self, tables: FactTables) -> None:
        probe = self._probes[tables] = Probe(tables.env, self._pattern, self._pattern.variables)
        if not self._pattern.says_absence:
            probe.follow(self._matched)

    def forget(self, tables: FactTables) -> None:
        del self._probes[tables]

    def check(self) -> None:
        if not self.changes.take():
            return
        self.is_evaluated = self.is_evaluated or self._pattern.says_absence or self.had_facts()
        if self._pattern.says_absence:
            for probe in self._probes.values():
                for values in probe.now():
                    self._matched(values)

    def _matched(self, values: Values) -> None:
        names = self._pattern.variables
        bindings = ", ".join(f"{name} = {value}" for name, value in zip(names, values, strict=True))
        self.scene.report(f"{self._pattern.text} matches" + (f": {bindings}" if bindings else ""))


class Always(PatternMonitor):
    """A pattern matches after each loop in each agent, from the end of the initialisation on."""

    def __init__(self, scene: Scene, pattern: ConditionPattern) -> None:
        super().__init__(scene, pattern)
        self._pattern = pattern
        self._probes: dict[FactTables, Probe] = {}

    def probe(self, tables: FactTables) -> None:
        self._probes[tables] = Probe(tables.env, self._pattern)

    def forget(self, tables: FactTables) -> None:
        del self._probes[tables]

    def check(self) -> None:
        if not self.is_evaluated:
            for tables in self._probes:
                if next(tables.env.facts("executive-initialized"), None) is None:
                    return
        if not self.changes.take() and self.is_evaluated:
            return
        self.is_evaluated = True
        for tables, probe in self._probes.items():
            if not probe.now():
                agent = f" in {tables.name}" if len(self._probes) > 1 else ""
                self.scene.report(f"{self._pattern.text} does not match{agent}")

    def state(self) -> Hashable | None:
        """Return whether the check has begun."""
        return self.is_evaluated


class Eventually(PatternMonitor):
    """A pattern matches at some moment in some agent.

    :param within_s: the limit since the start of the run; None for its end.
    """

    def __init__(self, scene: Scene, pattern: ConditionPattern, within_s: float | None) -> None:
        super().__init__(scene, pattern)
        self._pattern = pattern
        self._within_s = within_s
        self._matched = False
        self._probes: dict[FactTables, Probe] = {}

    def probe(self, tables: FactTables) -> None:
        probe = self._probes[tables] = Probe(tables.env, self._pattern)
        if not self._pattern.says_absence:
            probe.follow(self._note)

    def _note(self, _values: Values) -> None:
        self._matched = True

    def forget(self, tables: FactTables) -> None:
        del self._probes[tables]

    def check(self) -> None:
        self.is_evaluated = True
        if self._pattern.says_absence and self.changes.take():
            self._matched = self._matched or any(probe.now() for probe in self._probes.values())
        if self._within_s is not None and not self._matched and self.scene.seconds > self._within_s:
            self.scene.report(f"{self._pattern.text} has not matched within {self._within_s:g} s")

    def end(self, end: RunEnd) -> None:
        """Report a missing match, unless the run was cut before the limit."""
        if not self._matched and (end.ending is not Ending.CUT or self._within_s is None):
            self.scene.report(f"{self._pattern.text} has never matched")

    def state(self) -> Hashable | None:
        """Return whether the pattern has matched, or the remaining time."""
        if self._matched or self._within_s is None:
            return self._matched
        return round(self._within_s - self.scene.seconds, 3)


class After(PatternMonitor):
    """After a match of one pattern, another pattern matches at the same time or later.

    Variables with the same name have the same values in both. A modified fact that still matches is a new
    match.

    :param within_s: the limit since the first match; None for the end of the run.
    """

    def __init__(
        self, scene: Scene, first: ConditionPattern, second: ConditionPattern, within_s: float | None
    ) -> None:
        super().__init__(scene, first, second)
        self._first, self._second = first, second
        self._within_s = within_s
        self._shared = tuple(name for name in first.variables if name in second.variables)
        self._open: dict[tuple[str, Values], float] = {}
        self._fresh: set[str] = set()
        self._firsts: dict[str, Probe] = {}
        self._seconds: dict[str, Probe] = {}
        self._before: dict[str, set[Values]] = {}

    def probe(self, tables: FactTables) -> None:
        name = tables.name
        first = self._firsts[name] = Probe(tables.env, self._first, self._shared)
        second = self._seconds[name] = Probe(tables.env, self._second, self._shared)
        if not self._second.says_absence:
            second.follow(partial(self._then, name))
        if not self._first.says_absence:
            first.follow(partial(self._after, name))

    def forget(self, tables: FactTables) -> None:
        name = tables.name
        del self._firsts[name], self._seconds[name]
        self._before.pop(name, None)
        self._fresh.discard(name)
        self._open = {key: since for key, since in self._open.items() if key[0] != name}

    def _after(self, agent: str, values: Values) -> None:
        self.is_evaluated = True
        self._open.setdefault((agent, values), self.scene.seconds)
        self._fresh.add(agent)

    def _then(self, agent: str, values: Values) -> None:
        self._open.pop((agent, values), None)

    def check(self) -> None:
        """Check new matches and deadlines after a loop."""
        changed = self.changes.take()
        if self._first.says_absence and changed:
            for name, probe in self._firsts.items():
                now = probe.now()
                for values in now - self._before.get(name, set()):
                    self._after(name, values)
                self._before[name] = now
        for name, probe in self._seconds.items():
            # The second pattern may have matched before the first.
            if name in self._fresh or (changed and self._second.says_absence):
                for values in probe.now():
                    self._then(name, values)
        self._fresh.clear()
        if self._within_s is not None:
            for (_, values), since in self._open.items():
                if self.scene.seconds - since > self._within_s:
                    self._report(values, f"within {self._within_s:g} s")

    def end(self, end: RunEnd) -> None:
        """Report open obligations, unless the run was cut before the limit."""
        if end.ending is not Ending.CUT or self._within_s is None:
            for _, values in self._open:
                self._report(values, "until the end")

    def _report(self, values: Values, limit: str) -> None:
        bindings = ", ".join(f"{name} = {value}" for name, value in zip(self._shared, values, strict=True))
        self.scene.report(
            f"{self._second.text} has not matched {limit}, after {self._first.text}"
            + (f": {bindings}" if bindings else "")
        )

    def state(self) -> Hashable | None:
        """Return the open obligations with their times."""
        now = self.scene.seconds if self._within_s is not None else 0.0
        opened = (
            (agent, *values, round(now - since, 3) if self._within_s is not None else 0.0)
            for (agent, values), since in self._open.items()
        )
        return frozenset(opened), tuple(
            sorted((name, frozenset(each)) for name, each in self._before.items())
        )
