"""What a property is: a name, and a monitor for each run that says when the run does not have it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, Protocol

from cxbridge.events import Event

if TYPE_CHECKING:
    from cxbridge_explore.properties.tables import FactTables

NOTHING: Final[tuple[Hashable, ...]] = ()
"""The state of a monitor whose verdict depends on the facts that are there, and on nothing before."""


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
    :param message: what is wrong, in a sentence.
    :param seconds: when, since the run began, by its clock.
    :param goal: the id of the goal that it is about; empty for none. So are the others.
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
        """Return it as JSON can have it; what is empty is left out."""
        about = {"goal": self.goal, "action": self.action, "skill": self.skill}
        return {
            "property": self.property,
            "message": self.message,
            "seconds": round(self.seconds, 6),
            **{key: value for key, value in about.items() if value},
        }


class Scene(Protocol):
    """What a monitor sees of its run."""

    @property
    def seconds(self) -> float:
        """The time since the run began, by its clock."""

    @property
    def tables(self) -> Sequence[FactTables]:
        """The facts of each agent that is alive."""

    def report(self, message: str, *, goal: str = "", action: str = "", skill: str = "") -> None:
        """Say that the run does not have the property. What is said first counts."""


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
        """Look at what is left after the rules for the shutdown have run."""

    def state(self) -> Hashable | None:
        """Return all that later verdicts depend on beside the facts that are there.

        Times in it count from now. Ids of goals are strings of their own, so that who compares runs can
        rename them. None: nobody knows, and the run must not be taken for an equal one.
        """
        return NOTHING


@dataclass(frozen=True, slots=True)
class Property:
    """What must hold in every run.

    :param name: unique among the properties of a run.
    :param make: makes its monitor for a run.
    :param text: what it says, for people.
    :param source: the text that it can be read from again; empty when there is none.
    """

    name: str
    make: Callable[[Scene], Monitor]
    text: str
    source: str = ""
