"""The description of each class of events: name, topic, level, views and patterns.

Recordings, selections and streams read the description, so that a new kind of event needs no change there:
only its class, its producer, and readers that use its fields.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import ClassVar, Final

from msgspec import Struct, field


class RecordLevel(Enum):
    """The level of recording; each level includes the previous level."""

    TRANSITIONS = "transitions"
    RULES = "rules"
    FACTS = "facts"

    @property
    def event_types(self) -> frozenset[type[Event]]:
        """The types of events recorded at this level."""
        rank = list(RecordLevel).index  # of a level, in the order of the definitions above
        return frozenset(
            event_type for event_type in EVENT_TYPES.values() if rank(event_type.KIND.level) <= rank(self)
        )


class View(Enum):
    """A selection of events: ``trace diff`` compares and ``trace cat`` shows the events of a view."""

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
    :param topic: the topic of the events in mcap files.
    :param topic_field: the field at the end of the topic, as in ``/bb/Type/id``; empty if all events have the
        same topic.
    :param level: the lowest level at which the events are recorded.
    :param views: the views that include the events.
    :param pattern_fields: the fields that patterns can select, as in ``goal:env=executive``, by their names
        in patterns. A pattern without a name selects by the first field. An empty field means that the
        selection computes the value.
    :param subject_fields: the fields that identify the subject whose state the events describe, e.g. a goal;
        empty for events without state.
    :param detail_fields: the fields with details, such as parameters; empty in recordings without details.
    :param on_demand: whether the event is expensive, so that streams subscribe only while a client wants it.
    """

    name: str
    topic: str = ""
    topic_field: str = ""
    level: RecordLevel = RecordLevel.TRANSITIONS
    views: tuple[View, ...] = ()
    pattern_fields: Mapping[str, str] = field(default_factory=dict)
    subject_fields: tuple[str, ...] = ()
    detail_fields: tuple[str, ...] = ()
    on_demand: bool = False


EVENT_TYPES: Final[dict[str, type[Event]]] = {}
"""The classes of events that leave the process, by the name of the kind."""


def parse_pattern_fields(definition: str) -> dict[str, str]:
    """Return the fields of an event by their names in patterns.

    :param definition: words ``NAME=FIELD``, or ``NAME`` if the field has the same name.
    """
    pairs = (word.partition("=") for word in definition.split())
    return {name: field_name if equals else name for name, equals, field_name in pairs}


class Event(Struct, frozen=True):
    """An event of a run; subclasses add fields, and describe their kind in ``KIND``.

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
