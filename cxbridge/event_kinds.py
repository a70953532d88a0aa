"""The description of each class of events: name, topic, level, views and patterns.

Recordings, selections and streams depend only on it, so a new kind of event needs its class, its producer and
the readers that use it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import ClassVar, Final

from msgspec import Struct, field


class RecordLevel(Enum):
    """The level of recording; each level includes the previous one."""

    TRANSITIONS = "transitions"
    RULES = "rules"
    FACTS = "facts"

    @property
    def event_types(self) -> frozenset[type[Event]]:
        """The types of events recorded at this level."""
        levels = list(RecordLevel)
        recorded = levels[: levels.index(self) + 1]
        return frozenset(kind for kind in EVENT_TYPES.values() if kind.KIND.level in recorded)


class View(Enum):
    """The selection of events by which runs are compared and that ``trace cat`` shows."""

    TRANSITIONS = "transitions"
    SKILLS = "skills"
    RULES = "rules"
    FACTS = "facts"
    BLACKBOARD = "blackboard"

    @property
    def event_types(self) -> tuple[type[Event], ...]:
        """The types of events in this view."""
        return tuple(event_type for event_type in EVENT_TYPES.values() if self in event_type.KIND.views)


class EventDescription(Struct, frozen=True):
    """The properties of a kind of event.

    :param name: the name in files, options and streams, e.g. ``rule``; empty for events that stay in the
        process.
    :param topic: the topic of its messages in mcap files.
    :param topic_field: the field at the end of the topic, as in ``/bb/Type/id``; empty for a single topic.
    :param patterns: the fields for selection by their names in patterns; a pattern without
        a name applies to the first. An empty field means that the selection computes the value.
    :param subject: the fields that identify the subject of a state; empty for events without state.
    :param details: fields that some recordings lack; empty if not recorded.
    :param on_demand: whether the event is expensive, so that streams listen only while a client wants it.
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
"""The classes of events that leave the process, by the name of the kind."""


def pattern_fields(text: str) -> dict[str, str]:
    """Return fields by their names in patterns, from words ``NAME=FIELD``, or ``NAME`` if both are equal."""
    pairs = (word.partition("=") for word in text.split())
    return {name: field_name if equals else name for name, equals, field_name in pairs}


class Event(Struct, frozen=True):
    """An event of a run; subclasses add fields and their description ``KIND``.

    :param time_us: the run's clock, in microseconds since the epoch.
    """

    KIND: ClassVar[EventDescription] = EventDescription("")

    time_us: int

    def __init_subclass__(cls) -> None:
        """Add the class to :data:`EVENT_TYPES` if its kind has a name.

        :raises ValueError: if another class has the name.
        """
        name = cls.KIND.name
        # recordings find the class by this name
        if name and EVENT_TYPES.setdefault(name, cls) is not cls:
            raise ValueError(f"two kinds of events are called '{name}'")
