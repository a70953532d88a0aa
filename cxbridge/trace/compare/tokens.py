"""What counts of events in total order: keys that are the same in every run, and the names apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple, TypeAlias, cast

from cxbridge.event_kinds import View
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.compare.leftovers import Leftovers
from cxbridge.trace.compare.naming import MSGID, Namer, Names, interface_text, take_msgid
from cxbridge.trace.compare.select import Selection
from cxbridge.trace.compare.trail import Trail
from cxbridge.trace.formats.base import Run

Key: TypeAlias = tuple[Any, ...]
"""What counts of an event apart from names: its kind, then the fields that :data:`PARTS` lists."""

PARTS: Final[Mapping[str, tuple[str, ...]]] = {
    "goal": ("environment", "id", "class", "sub-type", "parent", "mode", "outcome", "error"),
    "plan-action": ("environment", "goal", "plan", "action id", "action", "state"),
    "skill": ("environment", "skiller", "skill string", "status"),
    "rule": ("environment", "rule"),
    "fact": ("environment", "template", "direction", "text"),
    "interface": ("interface", "values"),
}
"""What the parts of a key are, in words, after its kind."""

THREAD: Final[Mapping[str, int]] = {
    "goal": 3,
    "plan-action": 4,
    "skill": 3,
    "rule": 2,
    "fact": 3,
    "interface": 2,
}
"""So many parts of a key say what the event is a step of: a goal, a plan, a skiller."""


class Token(NamedTuple):
    """What counts of one event.

    :param names: the names in the parts of the key, in their order.
    :param thread_names: how many of them are in the parts that name the thread.
    :param msgid: the id of a message, counts as the distance to others of its thread; None: it has none.
    :param number: the event's number among those that are compared, from 0.
    """

    key: Key
    names: Names
    thread_names: int
    msgid: int | None
    event: Event
    number: int

    @property
    def thread(self) -> Key:
        """What the event is a step of; with :attr:`own_names` it is one in the run."""
        return self.key[: THREAD[self.key[0]]]

    @property
    def own_names(self) -> Names:
        """The names in the thread."""
        return self.names[: self.thread_names]


class Tokens:
    """Reads one run: iterate over it, once.

    :param trail: remembers what led to the event that was read last.
    """

    def __init__(self, run: Run, view: View, selection: Selection | None = None) -> None:
        self.count = 0
        self.namer = Namer()
        self.trail = Trail()
        self._run = run
        self._types = frozenset(view.event_types)
        self._selection = selection
        self._leftovers = Leftovers()
        self._makers: dict[type[Event], Callable[[Any], tuple[Key, Names, int, int | None] | None]] = {
            GoalTransition: self._goal,
            PlanActionTransition: self._action,
            SkillStatus: self._skill,
            RuleFired: self._rule,
            FactChange: self._fact,
            InterfaceWrite: self._interface,
        }

    def __iter__(self) -> Iterator[Token]:
        types, makers, trail = self._types, self._makers, self.trail
        take = self._selection.reader() if self._selection else None
        for event in self._run:
            kind = type(event)
            shown = kind in types
            kept: Event | None = event
            if take is not None and shown:
                kept = take(event)
                shown = kept is not None
            trail.take(event, self.count if shown else None)
            if not shown:
                continue
            number = self.count
            self.count += 1
            made = makers[kind](kept)
            if made is not None:
                yield Token(*made, cast("Event", kept), number)

    def _goal(self, event: GoalTransition) -> tuple[Key, Names, int, int | None]:
        split = self.namer.split
        goal, names = split(event.goal)
        parent, parent_names = split(event.parent)
        error, error_names = split(event.error)
        key = (
            "goal",
            event.env,
            goal,
            event.goal_class,
            event.sub_type,
            parent,
            event.mode,
            event.outcome,
            error,
        )
        return key, names + parent_names + error_names, len(names), None

    def _action(self, event: PlanActionTransition) -> tuple[Key, Names, int, int | None]:
        split = self.namer.split
        goal, goal_names = split(event.goal)
        plan, plan_names = split(event.plan)
        names = goal_names + plan_names
        key = ("plan-action", event.env, goal, plan, event.action_id, event.action, event.state)
        return key, names, len(names), None

    def _skill(self, event: SkillStatus) -> tuple[Key, Names, int, int | None] | None:
        counts = self._leftovers.fresh(event)
        if counts is None:
            return None
        text, names = self.namer.split(counts.skill_string)
        return ("skill", event.env, event.skiller, text, counts.status), names, 0, counts.msgid

    def _rule(self, event: RuleFired) -> tuple[Key, Names, int, int | None]:
        return ("rule", event.env, event.rule), (), 0, None

    def _fact(self, event: FactChange) -> tuple[Key, Names, int, int | None]:
        bare, msgid = take_msgid(event.text)
        text, names = self.namer.split_fact(bare)
        direction = "asserted" if event.asserted else "retracted"
        return ("fact", event.env, event.template, direction, text), names, 0, msgid

    def _interface(self, event: InterfaceWrite) -> tuple[Key, Names, int, int | None]:
        text, names = self.namer.split_fact(interface_text(event.values))
        msgid = event.values.get(MSGID)
        return ("interface", event.uid, text), names, 0, msgid if isinstance(msgid, int) else None
