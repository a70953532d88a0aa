"""Checks the properties of one run: calls their monitors during the run, and collects the violations."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from cxbridge_explore.properties.monitor import Monitor, Property, RunEnd, Scene, Violation
from cxbridge_explore.properties.tables import FactTables

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.events import Event
    from cxbridge.run.agent import Run


class PropertyWatch:
    """Checks the properties of a run. Create it before the agents are loaded, and add it to their watchers.

    A violated property is not checked any further, since its first violation is the verdict.

    :param properties: the properties, with different names.
    :param agents: the agents at the start of the run.
    :param clock: the run's clock; the run starts now.
    """

    def __init__(self, properties: Iterable[Property], agents: Sequence[Run], clock: Clock) -> None:
        self._tables_by_agent: dict[Run, FactTables] = {}
        self._monitors = [
            property_.make_monitor(Scene(property_.name, clock, self._tables_by_agent))
            for property_ in properties
        ]
        for agent in agents:
            self.joined(agent)

    def joined(self, agent: Run) -> None:
        """Watch an agent that joins the run, at its start or after a restart, and is not loaded yet."""
        tables = self._tables_by_agent[agent] = FactTables(agent.executive.env)
        for monitor in self._monitors:
            monitor.joined(tables)
            if monitor.event_types:
                agent.bus.subscribe(partial(_handle_event, monitor), *monitor.event_types)

    def left(self, agent: Run) -> None:
        """Forget an agent that was killed."""
        tables = self._tables_by_agent.pop(agent)
        for monitor in self._monitors:
            monitor.left(tables)

    def _undecided_monitors(self) -> Iterable[Monitor]:
        """Yield the monitors without a violation."""
        return (monitor for monitor in self._monitors if monitor.scene.violation is None)

    def check(self) -> bool:
        """Check the run after a loop, and return whether a property is violated."""
        for monitor in self._undecided_monitors():
            monitor.check()
        return bool(self.violations)

    def check_end(self, end: RunEnd) -> None:
        """Check the run at its end, before the shutdown rules fire."""
        self.check()
        for monitor in self._undecided_monitors():
            monitor.check_end(end)

    def check_shutdown(self) -> None:
        """Check the run after the shutdown rules; the environments may be closed."""
        for monitor in self._undecided_monitors():
            monitor.check_shutdown()

    @property
    def violations(self) -> list[Violation]:
        """The violations, in the order of time."""
        violations = (monitor.scene.violation for monitor in self._monitors)
        return sorted(filter(None, violations), key=lambda violation: violation.seconds)

    @property
    def evaluated_names(self) -> frozenset[str]:
        """The names of the properties that the run could have violated; the run decides no other property."""
        return frozenset(
            monitor.scene.name
            for monitor in self._monitors
            if monitor.is_evaluated or monitor.scene.violation is not None
        )

    def state(self) -> Hashable:
        """Return the state on which later verdicts depend, besides facts.

        A violated property has its final verdict, so only the violation is part of the state.
        """
        return tuple(
            (
                monitor.scene.name,
                monitor.state() if monitor.scene.violation is None else (monitor.scene.violation.message,),
            )
            for monitor in self._monitors
        )


def _handle_event(monitor: Monitor, event: Event) -> None:
    if monitor.scene.violation is None:
        monitor.handle_event(event)
