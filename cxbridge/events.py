"""The events of a run, the bus to recorders and other listeners, and loggers.

Producers emit events into an :class:`EventBus` and check :attr:`EventBus.wants` before expensive formatting.
:mod:`cxbridge.trace` converts events to files and back; events do not depend on file formats.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any

from msgspec import Struct

from cxbridge.clock import Clock
from cxbridge.event_kinds import Event, EventDescription, RecordLevel, View, parse_pattern_fields

__all__ = [
    "BlockWrite",
    "Event",
    "EventBus",
    "FactChange",
    "GoalTransition",
    "InterfaceMessage",
    "InterfaceWrite",
    "Level",
    "LogLine",
    "Logger",
    "LoopTime",
    "NavGraphRead",
    "PlanActionTransition",
    "PlannerCall",
    "Publication",
    "RuleFired",
    "Sink",
    "SkillStatus",
    "SourceRead",
]


class Level(Enum):
    """The levels of Fawkes' loggers; the value is the first letter of a line in its log file."""

    DEBUG = "D"
    INFO = "I"
    WARN = "W"
    ERROR = "E"


class LogLine(Event, frozen=True):
    """A line of text of a component."""

    KIND = EventDescription("log", "/log")

    level: Level
    component: str
    text: str


class RuleFired(Event, frozen=True):
    """A rule fired.

    :param env: the name of the CLIPS environment.
    :param number: the number of the firing in this ``(run)`` of CLIPS, from 1, as CLIPS prints it.
    :param basis: the matched facts as CLIPS prints them, e.g. ``f-8,f-86,*``.
    """

    KIND = EventDescription(
        "rule",
        "/rules",
        level=RecordLevel.RULES,
        views=(View.RULES,),
        pattern_fields=parse_pattern_fields("name=rule env"),
        on_demand=True,
    )

    env: str
    number: int
    rule: str
    basis: str


class FactChange(Event, frozen=True):
    """A fact was asserted or retracted.

    :param env: the name of the CLIPS environment.
    :param asserted: False for a retraction.
    :param index: 86 for ``f-86``.
    :param template: the deftemplate.
    :param text: the fact as CLIPS prints it on one line, e.g. ``(time 1 2)``.
    """

    KIND = EventDescription(
        "fact",
        "/facts",
        level=RecordLevel.FACTS,
        views=(View.FACTS,),
        pattern_fields=parse_pattern_fields("template env text"),
        on_demand=True,
    )

    env: str
    asserted: bool
    index: int
    template: str
    text: str


class GoalTransition(Event, frozen=True):
    """A goal is new, or its mode, outcome, parent or error changed.

    :param params: the slot ``params`` in parentheses as CLIPS prints it, ``(max-tries 3)``; empty if not
        recorded.
    :param meta: the slot ``meta`` in the form of ``params``; empty if not recorded.
    :param priority: the slot ``priority`` as CLIPS prints it; empty if not recorded.
    :param resources: the slot ``required-resources`` in the form of ``params``; empty if not recorded.
    :param is_new: whether the goal is new, as the id of a retracted goal may be reused; False if not
        recorded.
    :param slots: the other slots of the deftemplate as CLIPS prints them, without those with default values.
    """

    KIND = EventDescription(
        "goal",
        "/goals",
        views=(View.TRANSITIONS,),
        pattern_fields=parse_pattern_fields(
            "id=goal env class=goal_class sub-type=sub_type parent mode outcome error"
            " params meta priority resources"
        ),
        subject_fields=("env", "goal"),
        detail_fields=("params", "meta", "priority", "resources"),
    )

    env: str
    goal: str
    goal_class: str
    sub_type: str
    parent: str
    mode: str
    outcome: str
    error: str
    params: str = ""
    meta: str = ""
    priority: str = ""
    resources: str = ""
    is_new: bool = False
    slots: Mapping[str, str] = {}  # msgspec copies an empty default for each event

    @property
    def is_unnamed(self) -> bool:
        """Whether the goal has no id yet; the core assigns one immediately, which starts its life."""
        return self.goal == "nil" and self.mode == "FORMULATED"


class PlanActionTransition(Event, frozen=True):
    """A plan-action is new, or its state changed.

    :param params: the values of the action's parameters in parentheses as CLIPS prints them, ``(warn
        "This is a text")``; empty if not recorded.
    :param skiller: the id of the SkillerInterface that got the skill string; empty if not recorded, not sent,
        or sent to a skill board.
    :param call: the id of the message, or the name or number of the request on the skill board; empty if not
        recorded or not sent.
    """

    KIND = EventDescription(
        "plan-action",
        "/plan-actions",
        views=(View.TRANSITIONS,),
        # the selection computes the class: events of plan-actions have no goal class
        pattern_fields=parse_pattern_fields("action env goal plan id=action_id state class= params"),
        subject_fields=("env", "goal", "plan", "action_id"),
        detail_fields=("params",),
    )

    env: str
    action_id: str
    goal: str
    plan: str
    action: str
    state: str
    params: str = ""
    skiller: str = ""
    call: str = ""


class SkillStatus(Event, frozen=True):
    """The state of a Skiller: an event per new SkillerInterface fact of an executive, or per recorded write.

    :param msgid: the id of the message with the skill string; 0 if the Skiller processes none.
    """

    KIND = EventDescription(
        "skill",
        "/skills",
        views=(View.TRANSITIONS, View.SKILLS),
        pattern_fields=parse_pattern_fields("string=skill_string env skiller msgid status"),
        subject_fields=("env", "skiller"),
    )

    env: str
    skiller: str
    skill_string: str
    msgid: int
    status: str


class Publication(Event, frozen=True):
    """A write of an interface; subclasses have the values or the bytes.

    :param uid: ``Type::id`` of the interface.
    """

    uid: str


class InterfaceWrite(Publication, frozen=True):
    """A write of an interface, with the values.

    :param values: the values by field name, in the order of declaration.
    """

    KIND = EventDescription(
        "interface",
        "/bb/",
        topic_field="uid",
        views=(View.BLACKBOARD,),
        pattern_fields=parse_pattern_fields("uid"),
        subject_fields=("uid",),
        on_demand=True,
    )

    values: Mapping[str, Any]


class InterfaceMessage(Event, frozen=True):
    """A reader sent a message to the writer of an interface.

    :param uid: ``Type::id`` of the interface.
    :param message: the message's type, e.g. ``ExecSkillMessage``.
    :param msgid: the id that the sender has assigned.
    :param sender: the owner of the sending instance, empty if unknown.
    :param outcome: ``queued``, ``handled``, ``refused`` or ``sent``; see docs/formats.md#events.
    :param values: the values by field name, in the order of declaration.
    """

    KIND = EventDescription("message", "/messages/", topic_field="uid")

    uid: str
    message: str
    msgid: int
    sender: str
    outcome: str
    values: Mapping[str, Any]


class PlannerCall(Event, frozen=True):
    """A planner was called, or has ended.

    :param env: the name of the CLIPS environment.
    :param call: the id of the call, equal in both events; empty if the call could not start.
    :param goal: the id of the goal, ``nil`` for none.
    :param planner: the name of the planner; ``auto`` before cxbridge has chosen a planner.
    :param domain: the name of the PDDL domain; empty without a domain.
    :param problem: the goal formula.
    :param status: ``started``, ``found``, ``none``, ``failed``, ``cancelled`` or ``timeout``.
    :param duration_us: the real time since the call, in microseconds.
    :param actions: the number of actions in the plan; 0 without a plan.
    :param reason: why there is no plan; else empty.
    :param plan: an action per line: ``START: (NAME ARGUMENT...) [DURATION]``;
        without times if the plan only orders its actions.
    :param why: the reason for the choice of the planner: the planners that did not fit or failed.
    """

    KIND = EventDescription("planner", "/planner")

    env: str
    call: str
    goal: str
    planner: str
    domain: str
    problem: str
    status: str
    duration_us: int
    actions: int
    reason: str
    plan: str = ""
    why: str = ""


class NavGraphRead(Event, frozen=True):
    """A navigation graph was loaded.

    :param graph: the name of the graph.
    :param nodes: the nodes by name, each with ``x`` and ``y`` in metres, ``unconnected``, ``properties``.
    :param edges: the edges by ``A--B``, directed edges by ``A->B``, each with ``from``, ``to``, ``directed``.
    """

    KIND = EventDescription(
        "navgraph", "/navgraph", pattern_fields=parse_pattern_fields("graph"), subject_fields=("graph",)
    )

    graph: str
    nodes: Mapping[str, Any]
    edges: Mapping[str, Any]


class LoopTime(Event, frozen=True):
    """A cycle of the main loop. Not emitted on a virtual clock, where a cycle takes no time.

    :param loop: the number of the cycle, from 1.
    :param duration_us: the real time from the first to the last hook, in microseconds.
    """

    KIND = EventDescription("loop", "/loops", level=RecordLevel.RULES, on_demand=True)

    loop: int
    duration_us: int


class BlockWrite(Publication, frozen=True):
    """A write of an interface, with the bytes: bblogger files consist of blocks, and need no values.

    :param hash: the version of the interface type, 16 bytes.
    :param block: the whole block with time stamp, in the host's byte order.
    """

    hash: bytes
    block: bytes


class SourceRead(Event, frozen=True):
    """A source of the run, such as a file of the agent, was read or made; docs/formats.md lists the roles.

    :param role: ``clips``, ``config``, ``feature`` ...
    :param owner: the name of the CLIPS environment; empty if the source belongs to no environment.
    :param name: the requested path, or a name for a source without a file.
    :param data: the content; None for a source without content.
    :param details: further values by the keys of the role.
    """

    role: str
    owner: str
    name: str
    data: bytes | None
    details: Mapping[str, str]


Sink = Callable[[Event], None]
"""A function that gets the events of each producer in order, in the producer's thread."""


class EventBus:
    """Passes events to the sinks that subscribed to their type. Thread-safe.

    :param clock: gives the time of log lines and sources.
    """

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self._subscriptions: list[tuple[frozenset[type[Event]], Sink]] = []
        self._wanted_types: set[type] = set()
        self._sinks_by_type: dict[type[Event], tuple[Sink, ...]] = {}
        self._lock = threading.Lock()

    def subscribe(self, sink: Sink, *event_types: type[Event]) -> None:
        """Pass all further events of exactly these types to ``sink``, not those of derived types."""
        with self._lock:
            self._subscriptions = [*self._subscriptions, (frozenset(event_types), sink)]
            self._index_subscriptions()

    def unsubscribe(self, sink: Sink) -> None:
        """Stop passing events to ``sink``."""
        with self._lock:
            self._subscriptions = [
                (types, other_sink) for types, other_sink in self._subscriptions if other_sink != sink
            ]
            self._index_subscriptions()

    def _index_subscriptions(self) -> None:
        """Compute the tables for :meth:`wants` and :meth:`emit`."""
        event_types = frozenset().union(*(types for types, _ in self._subscriptions))
        # producers ask for base classes, too, e.g. for Publication before they choose a subclass
        self._wanted_types = {base for event_type in event_types for base in event_type.__mro__}
        # a dictionary by exact type, because every rule firing and every fact passes here
        self._sinks_by_type = {
            event_type: tuple(sink for types, sink in self._subscriptions if event_type in types)
            for event_type in event_types
        }

    def wants(self, event_type: type[Event]) -> bool:
        """Return whether a type, or a derived type, has a sink; producers ask before they make an event."""
        return event_type in self._wanted_types

    def emit(self, event: Event) -> None:
        """Pass an event to the sinks of its type."""
        # without the lock, in any thread: a subscription replaces the dictionary and never changes it
        for sink in self._sinks_by_type.get(type(event), ()):
            sink(event)

    def emit_source(
        self, role: str, owner: str, name: str, data: bytes | None = None, **details: str
    ) -> None:
        """Emit :class:`SourceRead` if it has a sink."""
        if self.wants(SourceRead):
            self.emit(SourceRead(self.clock.now_us(), role, owner, name, data, details))

    def logger(self, component: str) -> Logger:
        """Return a logger for a component."""
        return Logger(self, component)


class Logger(Struct, frozen=True):
    """Emits :class:`LogLine` events of one component."""

    bus: EventBus
    component: str

    @property
    def enabled(self) -> bool:
        """Whether log lines have a sink; producers ask before they format many lines."""
        return self.bus.wants(LogLine)

    def log(self, level: Level, text: str) -> None:
        """Emit a log line at a level."""
        if self.bus.wants(LogLine):
            self.bus.emit(LogLine(self.bus.clock.now_us(), level, self.component, text))

    def debug(self, text: str) -> None:
        """Emit a log line of level debug."""
        self.log(Level.DEBUG, text)

    def info(self, text: str) -> None:
        """Emit a log line of level info."""
        self.log(Level.INFO, text)

    def warn(self, text: str) -> None:
        """Emit a log line about a possible problem."""
        self.log(Level.WARN, text)

    def error(self, text: str) -> None:
        """Emit a log line about a failure."""
        self.log(Level.ERROR, text)
