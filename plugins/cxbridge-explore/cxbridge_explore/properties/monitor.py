"""Properties, and the monitors that check them in a run."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, Protocol

from cxbridge.events import Event

if TYPE_CHECKING:
    from cxbridge_explore.properties.tables import FactTables

# The state of a monitor whose verdict depends only on the current facts.
NOTHING: Final[tuple[Hashable, ...]] = ()


class Ending(Enum):
    """The kind of a run's end, as far as properties distinguish it."""

    OVER = "over"  # all root goals are finished or maintained, no skill runs, the agenda is empty
    STUCK = "stuck"  # nothing can happen any more
    CUT = "cut"  # given up: time limit, or a lost component


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
    :param seconds: since the start of the run, by its clock.
    :param goal: the id of the goal concerned, or empty.
    :param action: the plan-action concerned, as ``NAME ARGUMENT...``, or empty.
    :param skill: the skill concerned, or empty.
    """

    property: str
    message: str
    seconds: float
    goal: str = ""
    action: str = ""
    skill: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the violation as JSON values, without empty fields."""
        about = {"goal": self.goal, "action": self.action, "skill": self.skill}
        return {
            "property": self.property,
            "message": self.message,
            "seconds": round(self.seconds, 6),
            **{key: value for key, value in about.items() if value},
        }


class Scene(Protocol):
    """A monitor's view of the run."""

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each living agent."""

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        """Report a violation. Only the first report counts."""


class Monitor:
    """Checks one property in one run. All methods are called in the run's thread.

    :ivar is_evaluated: whether the property could have been violated; a property that no run evaluates is
        vacuous.
    """

    event_types: tuple[type[Event], ...] = ()

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.is_evaluated = False

    def begin(self) -> None:
        """Prepare for the start of the run."""

    def joined(self, tables: FactTables) -> None:
        """Start watching an agent before it is loaded: at the start, or after a restart."""

    def left(self, tables: FactTables) -> None:
        """Forget a killed agent, whose facts are already removed from the scene."""

    def take(self, event: Event) -> None:
        """Handle an event when it happens."""

    def look(self) -> None:
        """Check the run after a loop."""

    def end(self, end: RunEnd) -> None: ...

    def released(self) -> None:
        """Check the facts after the shutdown rules have run."""

    def state(self) -> Hashable | None:
        """Return the state on which later verdicts depend, besides the current facts.

        Times are relative to now. Ids of goals are separate strings, so that a comparison of runs can rename
        them. None means unknown: the run is not merged.
        """
        return NOTHING


@dataclass(frozen=True, slots=True)
class Property:
    """A property that must hold in every run.

    :param name: unique among the properties of a run.
    :param make: makes its monitor for a run.
    :param text: the description.
    :param source: the text that can be parsed again; may be empty.
    """

    name: str
    make: Callable[[Scene], Monitor]
    text: str
    source: str = ""
