"""Checks the properties of one run."""

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
    @property
    def executive(self) -> Executive: ...

    @property
    def bus(self) -> EventBus: ...


class PropertyScene:
    """The view of a run for the monitor of one property."""

    def __init__(self, name: str, watch: PropertyWatch) -> None:
        self.name = name
        self.violation: Violation | None = None
        self._watch = watch

    @property
    def seconds(self) -> float:
        return self._watch.seconds

    @property
    def tables(self) -> Sequence[FactTables]:
        return self._watch.tables

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        if self.violation is None:
            self.violation = Violation(self.name, message, self.seconds, goal, action, skill)


class PropertyWatch:
    """Checks the properties of a run. Create it before the agents are loaded.

    :param properties: with different names.
    :param clock: the run's clock; the run starts now.
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
        """The facts of each living agent."""
        return tuple(self._tables.values())

    def joined(self, agent: WatchedAgent) -> None:
        """Start watching an agent before it is loaded."""
        tables = self._tables[agent] = FactTables(agent.executive.env)
        is_new_bus = id(agent.bus) not in self._buses
        self._buses.add(id(agent.bus))
        for monitor, scene in self._monitors.values():
            monitor.joined(tables)
            if monitor.event_types and is_new_bus:
                agent.bus.subscribe(partial(_take, monitor, scene), *monitor.event_types)

    def left(self, agent: WatchedAgent) -> None:
        """Forget an agent that was killed."""
        tables = self._tables.pop(agent)
        for monitor, _ in self._monitors.values():
            monitor.left(tables)

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    def look(self) -> bool:
        """Check the run after a loop, and return whether a property is violated."""
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.look()
        return any(scene.violation is not None for _, scene in self._monitors.values())

    def end(self, end: RunEnd) -> None:
        """Check the run at its end, before the shutdown rules fire."""
        self.look()
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.end(end)

    def released(self) -> None:
        """Check the facts after the shutdown rules; the environments may be closed."""
        for monitor, scene in self._monitors.values():
            if scene.violation is None:
                monitor.released()

    @property
    def violations(self) -> list[Violation]:
        """The violations, in the order of time."""
        found = [scene.violation for _, scene in self._monitors.values() if scene.violation is not None]
        return sorted(found, key=lambda each: each.seconds)

    @property
    def evaluated(self) -> frozenset[str]:
        """The names of properties that the run could have violated; all further ones are undecided."""
        return frozenset(
            name
            for name, (monitor, scene) in self._monitors.items()
            if monitor.is_evaluated or scene.violation is not None
        )

    def state(self) -> Hashable | None:
        """Return the state on which later verdicts depend, besides facts; None if unknown.

        A violated property has its final verdict, so only the violation is part of the state.
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
