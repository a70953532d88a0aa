"""A property: a name, and a monitor for each run that reports a violation."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, Protocol

from cxbridge.events import Event

if TYPE_CHECKING:
    from cxbridge_explore.properties.tables import FactTables

NOTHING: Final[tuple[Hashable, ...]] = ()
"""The state of a monitor whose verdict depends on the present facts only."""


class Ending(Enum):
    """How a run came to its end, as far as properties ask for it."""

    OVER = "over"  # all root goals are over or maintain, no skill runs, the agenda is empty
    STUCK = "stuck"  # nothing can ever happen again
    CUT = "cut"  # it was given up: the time was up, or a component was lost


@dataclass(frozen=True, slots=True)
class RunEnd:
    """The end of a run.

    :param ending: how it came.
    :param reason: more about it, in a sentence; may be empty.
    """

    ending: Ending
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Violation:
    """A property that a run does not have.

    :param property: its name.
    :param message: the violation, in a sentence.
    :param seconds: the time since the start of the run, by its clock.
    :param goal: the id of the goal in question; empty: none. The same holds for the next fields.
    :param action: the plan-action, as ``NAME ARGUMENT...``.
    :param skill: the skill.
    """

    property: str
    message: str
    seconds: float
    goal: str = ""
    action: str = ""
    skill: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON, without empty fields."""
        about = {"goal": self.goal, "action": self.action, "skill": self.skill}
        return {
            "property": self.property,
            "message": self.message,
            "seconds": round(self.seconds, 6),
            **{key: value for key, value in about.items() if value},
        }


class Scene(Protocol):
    """The run as a monitor sees it."""

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each agent that is alive."""

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        """Report a violation. The first report counts."""


class Monitor:
    """Watches over one property in one run. Its methods are called in the run's thread.

    :ivar event_types: the events that :meth:`take` gets.
    :ivar is_evaluated: whether there was an occasion at which the property could have been violated; a
        property for which there was none in any run is vacuous.
    """

    event_types: tuple[type[Event], ...] = ()

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.is_evaluated = False

    def begin(self) -> None:
        """Prepare; the run is about to begin."""

    def joined(self, tables: FactTables) -> None:
        """Follow an agent that is about to be loaded: at the beginning, or after it was killed."""

    def left(self, tables: FactTables) -> None:
        """Forget an agent that was killed; its facts are none of the scene's any more."""

    def take(self, event: Event) -> None:
        """Take an event, at the moment at which it happens."""

    def look(self) -> None:
        """Look at the run after a loop."""

    def end(self, end: RunEnd) -> None:
        """Look at the run at its end."""

    def released(self) -> None:
        """Look at the facts after the rules for the shutdown have run."""

    def state(self) -> Hashable | None:
        """Return the state on which later verdicts depend, besides the present facts.

        Times in it count from now. Ids of goals are separate strings, so that a comparison of runs can
        rename them. None: unknown, and the run is not merged with another.
        """
        return NOTHING


@dataclass(frozen=True, slots=True)
class Property:
    """What must hold in every run.

    :param name: unique among the properties of a run.
    :param make: makes its monitor for a run.
    :param text: its description for people.
    :param source: the text that it can be read from again; empty when there is none.
    """

    name: str
    make: Callable[[Scene], Monitor]
    text: str
    source: str = ""
