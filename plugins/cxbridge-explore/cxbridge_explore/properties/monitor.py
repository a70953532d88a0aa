"""Properties, and the base class of the monitors that check properties in a run.

A monitor is made before the agents of its run are loaded. The monitor checks the run after each loop, at the
end, and after the shutdown rules, and reports at most one violation.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.events import Event
from cxbridge_explore.properties.tables import ChangeFlag, FactTables

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

# The state of a monitor whose verdict depends only on the current facts.
NO_STATE: Final[tuple[Hashable, ...]] = ()


class Ending(Enum):
    """The kinds of ends of runs that properties distinguish."""

    OVER = "over"  # all root goals are finished or maintained, no skill runs, the agenda is empty
    STUCK = "stuck"  # nothing can happen any more
    CUT = "cut"  # ended early, by the time limit or the loss of a component


@dataclass(frozen=True, slots=True)
class RunEnd:
    """The end of a run.

    :param reason: further details in a sentence; may be empty.
    """

    ending: Ending
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Violation:
    """A violated property.

    :param property: the name of the property.
    :param message: the violation, in a sentence.
    :param seconds: the time since the start of the run, by its clock.
    :param goal: the id of the goal that is concerned, or empty.
    :param action: the plan-action that is concerned, as ``NAME ARGUMENT...``, or empty.
    :param skill: the skill that is concerned, or empty.
    """

    property: str
    message: str
    seconds: float
    goal: str = ""
    action: str = ""
    skill: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the violation as JSON values, without empty fields."""
        concerned = {"goal": self.goal, "action": self.action, "skill": self.skill}
        return {
            "property": self.property,
            "message": self.message,
            "seconds": round(self.seconds, 6),
            **{key: value for key, value in concerned.items() if value},
        }


class Scene:
    """The view of one monitor on its run, and the verdict on its property.

    :param name: the name of the property.
    :param clock: the run's clock; the run starts now.
    :param tables_by_agent: the facts of the living agents. The mapping changes when agents are killed and
        restarted.
    """

    def __init__(self, name: str, clock: Clock, tables_by_agent: Mapping[Run, FactTables]) -> None:
        self.name = name
        self.violation: Violation | None = None
        self._clock, self._tables_by_agent = clock, tables_by_agent
        self._start_us = clock.now_us()

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return (self._clock.now_us() - self._start_us) / MICROSECONDS

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each living agent."""
        return tuple(self._tables_by_agent.values())

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        """Report a violation. Only the first report counts."""
        if self.violation is None:
            self.violation = Violation(self.name, message, self.seconds, goal, action, skill)


class Monitor:
    """Checks one property in one run. All methods are called in the run's thread.

    :cvar event_types: the types of events for :meth:`handle_event`.
    :cvar templates: the deftemplates whose changes ``changes`` records.
    :ivar is_evaluated: whether the property could have been violated; a property that no run evaluates is
        vacuous.
    """

    event_types: tuple[type[Event], ...] = ()
    templates: tuple[str, ...] = ()

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.changes = ChangeFlag()
        self.is_evaluated = False

    def joined(self, tables: FactTables) -> None:
        """Watch an agent that is not loaded yet, at the start of the run or after a restart."""
        self.changes.is_pending = True
        for template in self.templates:
            tables.follow(template, self.changes)

    def left(self, tables: FactTables) -> None:
        """Forget a killed agent, whose facts are already removed from the scene."""

    def handle_event(self, event: Event) -> None:
        """Handle an event when it happens."""

    def check(self) -> None:
        """Check the run after a loop."""

    def check_end(self, end: RunEnd) -> None:
        """Check the run at its end, before the shutdown rules fire."""

    def check_shutdown(self) -> None:
        """Check the run after the shutdown rules have fired."""

    def state(self) -> Hashable:
        """Return the state on which later verdicts depend, besides the current facts.

        Times are relative to now. Ids of goals are separate strings, so that a comparison of runs can rename
        them.
        """
        return NO_STATE


@dataclass(frozen=True, slots=True)
class Property:
    """A property that must hold in every run.

    :param name: the name, unique among the properties of a run.
    :param make_monitor: makes the monitor of the property for a run.
    :param text: the description.
    :param source: the text that can be parsed again; empty for a property that Python code has made.
    """

    name: str
    make_monitor: Callable[[Scene], Monitor]
    text: str
    source: str = ""
