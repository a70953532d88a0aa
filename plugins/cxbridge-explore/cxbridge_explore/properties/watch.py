"""Watches over the properties of one run."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Protocol

from cxbridge.clock import MICROSECONDS
from cxbridge_explore.properties.monitor import Monitor, Property, RunEnd, Violation
from cxbridge_explore.properties.tables import FactTables

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.events import Event, EventBus
    from cxbridge.executive.executive import Executive


class WatchedAgent(Protocol):
    """An agent of a run."""

    @property
    def executive(self) -> Executive:
        """Its executive."""

    @property
    def bus(self) -> EventBus:
        """Its events."""


class PropertyScene:
    """A run as the monitor of one property sees it.

    :param name: the property's.
    """

    def __init__(self, name: str, watch: PropertyWatch) -> None:
        self.name = name
        self.violation: Violation | None = None
        self._watch = watch

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""
        return self._watch.seconds

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each agent."""
        return self._watch.tables

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        """Report a violation. The first report counts."""
        if self.violation is None:
            self.violation = Violation(self.name, message, self.seconds, goal, action, skill)


class PropertyWatch:
    """Watches over the properties of a run. To be made before the agents are loaded.

    :param properties: their names differ.
    :param agents: of the run.
    :param clock: of the run, which begins now.
    :raises CxbridgeError: when a property is wrong.
    """

    def __init__(self, properties: Iterable[Property], agents: Sequence[WatchedAgent], clock: Clock) -> None:
        self._tables: dict[WatchedAgent, FactTables] = {}
        self._buses: set[int] = set()
        self._clock = clock
        self._start_us = clock.now_us()
        self._monitors: dict[str, tuple[Monitor, PropertyScene]] = {}
        for each in properties:
            scene = PropertyScene(each.name, self)
            self._monitors[each.name] = (each.make(scene), scene)
        for monitor, _ in self._monitors.values():
            monitor.begin()
        for agent in agents:
            self.joined(agent)

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each agent that is alive."""
        return tuple(self._tables.values())

    def joined(self, agent: WatchedAgent) -> None:
        """Watch an agent, too, which is about to be loaded."""
        tables = self._tables[agent] = FactTables(agent.executive.env)
        is_new_bus = id(agent.bus) not in self._buses
        self._buses.add(id(agent.bus))
        for monitor, scene in self._monitors.values():
            monitor.joined(tables)
            if monitor.event_types and is_new_bus:
                agent.bus.subscribe(partial(_take, monitor, scene), *monitor.event_types)

    def left(self, agent: WatchedAgent) -> None:
        """Take an agent that was killed for gone."""
        tables = self._tables.pop(agent)
        for monitor, _ in self._monitors.values():
            monitor.left(tables)

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    def look(self) -> bool:
        """Look at the run after a loop; return whether some property is violated by now."""
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.look()
        return any(scene.violation is not None for _, scene in self._monitors.values())

    def end(self, end: RunEnd) -> None:
        """Look at the run at its end, before the rules for the shutdown run."""
        self.look()
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.end(end)

    def released(self) -> None:
        """Look at the facts after the rules for the shutdown have run; the environments may be closed."""
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.released()

    @property
    def violations(self) -> list[Violation]:
        """The properties that the run does not have, the first violated first."""
        found = [scene.violation for _, scene in self._monitors.values() if scene.violation is not None]
        return sorted(found, key=lambda each: each.seconds)

    @property
    def evaluated(self) -> frozenset[str]:
        """The names of the properties that could have been violated; the rest is undecided in this run."""
        return frozenset(
            name
            for name, (monitor, scene) in self._monitors.items()
            if monitor.is_evaluated or scene.violation is not None
        )

    def state(self) -> Hashable | None:
        """Return the state on which later verdicts depend, besides the facts; None when unknown.

        A property that is violated has its verdict, and so no state but that.
        """
        states: list[Hashable] = []
        for name, (monitor, scene) in self._monitors.items():
            state = monitor.state() if scene.violation is None else (scene.violation.message,)
            if state is None:
                return None
            states.append((name, state))
        return tuple(states)


def _take(monitor: Monitor, scene: PropertyScene, event: Event) -> None:
    if scene.violation is None:
        monitor.take(event)
