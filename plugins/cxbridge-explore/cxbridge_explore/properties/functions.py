"""Properties that Python functions check, given the events of a run."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial

from cxbridge.events import Event, LogLine
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge_explore.properties.monitor import Monitor, Property, RunEnd, Scene

# Called at the end of a run with the events of the run; returns the violation in a sentence, or None.
EventFunction = Callable[[Sequence[Event]], str | None]


def make_property(function: EventFunction, *event_types: type[Event]) -> Property:
    """Make a property that a function checks. Runs with such a property are never merged.

    :param event_types: the types of events to collect; by default transitions and log lines.
    """
    types = event_types or (*TRANSITION_TYPES, LogLine)
    text = (function.__doc__ or "").strip().partition("\n")[0]
    name = getattr(function, "__name__", "function")
    return Property(name, partial(_EventMonitor, function=function, types=types), text)


class _EventMonitor(Monitor):
    """Collects events for a function."""

    def __init__(self, scene: Scene, function: EventFunction, types: tuple[type[Event], ...]) -> None:
        super().__init__(scene)
        self.event_types = types
        self._function = function
        self._events: list[Event] = []

    def handle_event(self, event: Event) -> None:
        self._events.append(event)

    def check_end(self, end: RunEnd) -> None:  # noqa: ARG002 - the same for each kind of end
        self.is_evaluated = True
        violation = self._function(self._events)
        if violation:
            self.scene.report(violation)

    def state(self) -> Hashable | None:
        return None  # unknown, since the function may depend on all events
