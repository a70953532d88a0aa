"""The events of a run as values, the bus that carries them to recorders and other listeners, and loggers.

An event knows nothing of the format it will be stored in. The producers emit into an :class:`EventBus`;
:mod:`cxbridge.trace` turns events into files and files back into events. Producers ask
:attr:`EventBus.wants` before they format anything expensive.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from cxbridge.clock import Clock
from cxbridge.event_kinds import Event, EventDescription, RecordLevel, View, pattern_fields

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
    """Levels of Fawkes' loggers; the value is the letter that starts a line of its log file."""

    DEBUG = "D"
    INFO = "I"
    WARN = "W"
    ERROR = "E"


class LogLine(Event, frozen=True):
    """A line of text for people, from a component, at a level."""

    KIND = EventDescription("log", "/log")

    level: Level
    component: str
    text: str


class RuleFired(Event, frozen=True):
    """A rule fired.

    :param env: name of the CLIPS environment.
    :param number: its number in this ``run``, from 1, as CLIPS prints it.
    :param rule: name of the rule.
    :param basis: the facts it fired for as CLIPS prints them, e.g. ``f-8,f-86,*``.
    """

    KIND = EventDescription(
        "rule",
        "/rules",
        level=RecordLevel.RULES,
        views=(View.RULES,),
        patterns=pattern_fields("name=rule env"),
        on_demand=True,
    )

    env: str
    number: int
    rule: str
    basis: str


class FactChange(Event, frozen=True):
    """A fact came or went.

    :param env: name of the CLIPS environment.
    :param asserted: True when it was asserted, False when it was retracted.
    :param index: the fact's index: 86 for ``f-86``.
    :param template: its deftemplate.
    :param text: the fact as CLIPS prints it on one line, e.g. ``(time 1 2)``.
    """

    KIND = EventDescription(
        "fact",
        "/facts",
        level=RecordLevel.FACTS,
        views=(View.FACTS,),
        patterns=pattern_fields("template env text"),
        on_demand=True,
    )

    env: str
    asserted: bool
    index: int
    template: str
    text: str


class GoalTransition(Event, frozen=True):
    """A goal got another mode, outcome, parent or error, or is new.

    :param params: the slot ``params`` at that time, in parentheses, as CLIPS prints the fields:
        ``(max-tries 3)``; empty: not recorded. ``meta`` and ``resources`` (those that it requires): likewise.
    :param priority: as CLIPS prints it; empty: not recorded.
    :param is_new: whether the goal is a new one: an agent may use the id of a goal whose fact is gone. False:
        it is not, or that is not recorded.
    :param slots: the other slots of the deftemplate as CLIPS prints them, those with another value than the
        default one.
    """

    KIND = EventDescription(
        "goal",
        "/goals",
        views=(View.TRANSITIONS,),
        patterns=pattern_fields(
            "id=goal env class=goal_class sub-type=sub_type parent mode outcome error"
            " params meta priority resources"
        ),
        subject=("env", "goal"),
        details=("params", "meta", "priority", "resources"),
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
    slots: Mapping[str, str] = {}

    @property
    def is_unnamed(self) -> bool:
        """Whether the goal has no id yet: the core gives it one at once, and its life begins with that."""
        return self.goal == "nil" and self.mode == "FORMULATED"


class PlanActionTransition(Event, frozen=True):
    """A plan-action got another state, or is new.

    :param params: the values of its parameters at that time, in parentheses, as CLIPS prints them:
        ``(warn "This is a text")``; empty: not recorded.
    :param skiller: id of the SkillerInterface that the action was sent to; empty: not recorded, not sent yet,
        or sent to a skill board.
    :param call: number of the message that sent it, or the name or number of the request on the skill board;
        empty: not recorded, or not sent yet.
    """

    KIND = EventDescription(
        "plan-action",
        "/plan-actions",
        views=(View.TRANSITIONS,),
        patterns=pattern_fields("action env goal plan id=action_id state class= params"),
        subject=("env", "goal", "plan", "action_id"),
        details=("params",),
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
    """The state of a Skiller as the executive reads it: one event for each new SkillerInterface fact."""

    KIND = EventDescription(
        "skill",
        "/skills",
        views=(View.TRANSITIONS, View.SKILLS),
        patterns=pattern_fields("string=skill_string env skiller msgid status"),
        subject=("env", "skiller"),
    )

    env: str
    skiller: str
    skill_string: str
    msgid: int
    status: str


class Publication(Event, frozen=True):
    """A writer published an interface: the common fields of its events.

    :param uid: ``Type::id``.
    """

    uid: str


class InterfaceWrite(Publication, frozen=True):
    """A writer published an interface: its values.

    :param values: field names and their values, in declaration order.
    """

    KIND = EventDescription(
        "interface",
        "/bb/",
        "uid",
        views=(View.BLACKBOARD,),
        patterns=pattern_fields("uid"),
        subject=("uid",),
        on_demand=True,
    )

    values: Mapping[str, Any]


class InterfaceMessage(Event, frozen=True):
    """A reader sent a message to the writer of an interface.

    :param uid: ``Type::id`` of the interface.
    :param message: the message's type, e.g. ``ExecSkillMessage``.
    :param msgid: the number that its sender gave it.
    :param sender: owner of the instance that sent it; empty when that is not known.
    :param outcome: ``queued``, ``handled``, ``refused`` or ``sent``; see docs/formats.md#events.
    :param values: field names and their values, in declaration order.
    """

    KIND = EventDescription("message", "/messages/", "uid")

    uid: str
    message: str
    msgid: int
    sender: str
    outcome: str
    values: Mapping[str, Any]


class PlannerCall(Event, frozen=True):
    """A planner was called, or has ended.

    :param env: name of the CLIPS environment.
    :param call: the call's id, the same in both events; empty when it could not be made.
    :param goal: id of the goal that it was called for; ``nil`` for none.
    :param planner: its name, ``auto`` when it was to be chosen.
    :param domain: name of the PDDL domain; empty when there is none.
    :param problem: the formula that is to be reached.
    :param status: ``started``, ``found``, ``none``, ``failed``, ``cancelled`` or ``timeout``.
    :param duration_us: real time since the call.
    :param actions: length of the plan that was found.
    :param reason: why there is no plan; empty when there is one, and at the start.
    :param plan: the plan that was found, an action a line: ``START: (NAME ARGUMENT...) [DURATION]``, without
        times when it is just an order.
    :param why: why this planner was chosen: which planners did not fit or failed before.
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
    """A navigation graph was read.

    :param graph: its name.
    :param nodes: by name: ``x`` and ``y`` in metres, ``unconnected``, ``properties``.
    :param edges: by their ends: ``from``, ``to``, ``directed``.
    """

    KIND = EventDescription("navgraph", "/navgraph", patterns=pattern_fields("graph"), subject=("graph",))

    graph: str
    nodes: Mapping[str, Any]
    edges: Mapping[str, Any]


class LoopTime(Event, frozen=True):
    """The main loop ran once. Not emitted on a virtual clock, where a loop takes no time.

    :param loop: number of the loop, from 1.
    :param duration_us: real time from its first to its last hook, microseconds.
    """

    KIND = EventDescription("loop", "/loops", level=RecordLevel.RULES, on_demand=True)

    loop: int
    duration_us: int


class BlockWrite(Publication, frozen=True):
    """A writer published an interface: its bytes.

    :param hash: version of the interface type, 16 bytes.
    :param block: the whole block, time stamp included, in the host's byte order.
    """

    hash: bytes
    block: bytes


class SourceRead(Event, frozen=True):
    """Something that the run is made of was read, or made; docs/formats.md lists the roles.

    :param role: ``clips``, ``config``, ``feature`` ...
    :param owner: name of the CLIPS environment that it belongs to; empty for none.
    :param name: the requested path, or a name for a source without a file.
    :param data: the content; None for a source without content.
    :param details: more, by the keys of the role.
    """

    role: str
    owner: str
    name: str
    data: bytes | None
    details: Mapping[str, str]


Sink = Callable[[Event], None]
"""Something that takes events. Called in the thread of the producer, in order."""


@dataclass
class EventBus:
    """Hands every event to every sink that wants events of its type. Thread-safe.

    :param clock: gives the time of log lines.
    """

    clock: Clock
    _sinks: list[tuple[frozenset[type[Event]], Sink]] = field(default_factory=list)
    _wanted: set[type] = field(default_factory=set)
    _takers: dict[type[Event], tuple[Sink, ...]] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False, compare=False)

    def subscribe(self, sink: Sink, *event_types: type[Event]) -> None:
        """Give ``sink`` all events of these types from now on."""
        with self._lock:
            self._sinks = [*self._sinks, (frozenset(event_types), sink)]
            self._note_wanted()

    def unsubscribe(self, sink: Sink) -> None:
        """Give ``sink`` nothing any more."""
        with self._lock:
            self._sinks = [(types, other) for types, other in self._sinks if other != sink]
            self._note_wanted()

    def _note_wanted(self) -> None:
        """Work out what :meth:`wants` answers, and who gets what."""
        types = (event_type for types, _ in self._sinks for event_type in types)
        self._wanted = {kind for event_type in types for kind in event_type.__mro__}
        self._takers = {
            kind: tuple(sink for types, sink in self._sinks if kind in types)
            for kind in frozenset().union(*(types for types, _ in self._sinks))
        }

    def wants(self, event_type: type[Event]) -> bool:
        """Whether anybody listens to this type, or one derived from it; ask before making an event."""
        return event_type in self._wanted

    def emit(self, event: Event) -> None:
        """Hand ``event`` to the sinks that want its type."""
        for sink in self._takers.get(type(event), ()):
            sink(event)

    def emit_source(
        self, role: str, owner: str, name: str, data: bytes | None = None, **details: str
    ) -> None:
        """Emit :class:`SourceRead` if a listener takes it."""
        if self.wants(SourceRead):
            self.emit(SourceRead(self.clock.now_us(), role, owner, name, data, details))

    def logger(self, component: str) -> Logger:
        """Return a logger that speaks for ``component``."""
        return Logger(self, component)


@dataclass(frozen=True, slots=True)
class Logger:
    """Emits :class:`LogLine` events for one component."""

    bus: EventBus
    component: str

    @property
    def enabled(self) -> bool:
        """Whether a listener takes log lines; code with many lines asks before it formats them."""
        return self.bus.wants(LogLine)

    def log(self, level: Level, text: str) -> None:
        """Emit ``text`` at ``level``."""
        if self.bus.wants(LogLine):
            self.bus.emit(LogLine(self.bus.clock.now_us(), level, self.component, text))

    def debug(self, text: str) -> None:
        """Emit ``text`` with the level debug."""
        self.log(Level.DEBUG, text)

    def info(self, text: str) -> None:
        """Emit ``text`` for all subscribers."""
        self.log(Level.INFO, text)

    def warn(self, text: str) -> None:
        """Emit ``text`` about something that may be wrong."""
        self.log(Level.WARN, text)

    def error(self, text: str) -> None:
        """Emit ``text`` about something that went wrong."""
        self.log(Level.ERROR, text)
