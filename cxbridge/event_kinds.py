"""The description that each class of events carries: its name, topic, level, views and patterns.

Recordings, selections and streams derive their knowledge of a kind of event from it, so a new
kind is its class, its producer, and readers that care.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import ClassVar, Final

from msgspec import Struct, field


class RecordLevel(Enum):
    """How much of a run is recorded; each level contains the level before it."""

    TRANSITIONS = "transitions"
    RULES = "rules"
    FACTS = "facts"

    @property
    def event_types(self) -> frozenset[type[Event]]:
        """The types of events that are recorded at this level."""
        levels = list(RecordLevel)
        kept = levels[: levels.index(self) + 1]
        return frozenset(event_type for event_type in EVENT_TYPES.values() if event_type.KIND.level in kept)


class View(Enum):
    """What two runs are compared by, and what ``trace cat`` shows."""

    TRANSITIONS = "transitions"
    SKILLS = "skills"
    RULES = "rules"
    FACTS = "facts"
    BLACKBOARD = "blackboard"

    @property
    def event_types(self) -> tuple[type[Event], ...]:
        """The types of events that this view shows."""
        return tuple(event_type for event_type in EVENT_TYPES.values() if self in event_type.KIND.views)


class EventDescription(Struct, frozen=True):
    """The properties of a kind of event besides its fields.

    :param name: in files, options and streams, e.g. ``rule``; empty: such events stay in the process.
    :param topic: of its messages in mcap files.
    :param topic_field: the field that the topic ends with, as in ``/bb/Type/id``; empty: all have one topic.
    :param level: the lowest level that records it.
    :param views: the views that show the event, and compare runs by it.
    :param patterns: the fields that it is selected by, by their names in patterns; the first is the field of
        a bare pattern. An empty field is one that the selection has to find elsewhere.
    :param subject: the fields that identify the subject of the state; empty: the event carries no state.
    :param details: fields that not every recording has; empty in an event, they are not recorded.
    :param on_demand: whether the event is expensive to make: streams listen only while a client wants it.
    """

    name: str
    topic: str = ""
    topic_field: str = ""
    level: RecordLevel = RecordLevel.TRANSITIONS
    views: tuple[View, ...] = ()
    patterns: Mapping[str, str] = field(default_factory=dict)
    subject: tuple[str, ...] = ()
    details: tuple[str, ...] = ()
    on_demand: bool = False


EVENT_TYPES: Final[dict[str, type[Event]]] = {}
"""The class of each kind of event that leaves the process, by the kind's name."""


def pattern_fields(text: str) -> dict[str, str]:
    """Return fields by their names in patterns, of words ``NAME=FIELD``, or ``NAME`` for both."""
    pairs = (word.partition("=") for word in text.split())
    return {name: field_name if equals else name for name, equals, field_name in pairs}


class Event(Struct, frozen=True):
    """An event of a run. A subclass adds fields, and describes itself in ``KIND``.

    :param time_us: the run's clock, microseconds since the epoch.
    """

    KIND: ClassVar[EventDescription] = EventDescription("")

    time_us: int

    def __init_subclass__(cls) -> None:
        """Enter a class into :data:`EVENT_TYPES` when its kind has a name.

        :raises ValueError: when another class has this name.
        """
        name = cls.KIND.name
        if name and EVENT_TYPES.setdefault(name, cls) is not cls:
            raise ValueError(f"two kinds of events are called '{name}'")
