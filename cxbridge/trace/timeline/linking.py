"""Which skill a plan-action ran, and which writes of the Skiller's interface told of it.

A recording does not say it in so many words. The executive sees the skill run, and lets the action go
from WAITING to RUNNING; it sees the skill end, and the action ends. So an action that waited when a
skill began may be the one, if it went to RUNNING before the skill was over. Where facts are recorded they
tell which Skiller an action is for, and its arguments: then it is one of those for that Skiller, and the
one with most of its arguments in the skill string. Of several it is the one that ended when the skill did,
then one that is called like the skill, then the one that waited longest.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from operator import itemgetter

from cxbridge.trace.report.model import Action, InterfaceCount, RunModel, SkillCall

WAITING = frozenset({"PENDING", "WAITING"})
RUNNING = "RUNNING"
RUNS = "S_RUNNING"
ENDED = frozenset({"S_FINAL", "S_FAILED"})

SAME_US = 100_000
"""Ends of an action and a skill that are less apart tell nothing: the executive looks now and then."""


@dataclass(frozen=True, slots=True)
class Link:
    """A plan-action and its skill.

    :param ordered: seq and time when the action began to wait for the skill.
    :param began: where the write that told that the skill runs is in :attr:`RunModel.changes`, None when none
        is recorded. ``ended``: that which told how it ended.
    """

    action: Action
    call: SkillCall
    ordered: tuple[int, int]
    began: int | None
    ended: int | None


@dataclass(frozen=True, slots=True)
class _Wait:
    """An action that waited, and then ran.

    :param ordered: seq and time when it last was what it was before it ran. ``ran``: seq when it ran.
    :param over: time when it ran no more, None when that is not recorded.
    """

    action: Action
    ordered: tuple[int, int]
    ran: int
    over: int | None


def links(model: RunModel) -> list[Link]:
    """Return the skills whose actions are known, in order."""
    waits = sorted(_waits(model), key=lambda wait: wait.ran)
    ran_at = [wait.ran for wait in waits]
    writes = _Writes(model)
    skillers = {call.skiller for call in model.calls}
    taken: set[tuple[int, int]] = set()
    found = []
    for call in model.calls:
        limit = call.end[0] if call.end is not None else model.events
        could = [
            wait
            for wait in waits[bisect_right(ran_at, call.begin[0]) : bisect_right(ran_at, limit)]
            if wait.ordered[0] < call.begin[0]
            and wait.action.env == call.env
            # a name that is no Skiller's here says nothing: a robot's, where one Skiller serves them all
            and (wait.action.order.skiller == call.skiller or wait.action.order.skiller not in skillers)
            and (wait.action.number, wait.ran) not in taken
        ]
        if could:
            wait = min(could, key=partial(_unlikely, call, model.end))
            taken.add((wait.action.number, wait.ran))
            found.append(Link(wait.action, call, wait.ordered, *writes.of(call, wait.ordered[0])))
    return found


def _waits(model: RunModel) -> Iterator[_Wait]:
    """Yield how actions waited for skills."""
    for action in model.actions:
        states = action.states
        for place, (before, state) in enumerate(pairwise(states)):
            if state[2] == RUNNING and before[2] in WAITING:
                after = states[place + 2 : place + 3]
                yield _Wait(action, before[:2], state[0], after[0][1] if after else None)


def _unlikely(call: SkillCall, end: int, wait: _Wait) -> tuple[int, int, bool, int]:
    """Return what tells that an action ran another skill: the less, the better."""
    over = call.end[1] if call.end is not None else end
    gap = abs((end if wait.over is None else wait.over) - over)
    told = wait.action.order.told_in(call.skill_string)
    return -told, gap // SAME_US, wait.action.name != _name(call.skill_string), wait.ordered[0]


def _name(skill_string: str) -> str:
    """Return the name of the skill that a skill string calls."""
    return skill_string.partition("{")[0].partition("(")[0].strip()


class _Writes:
    """The changes of each Skiller's interface."""

    def __init__(self, model: RunModel) -> None:
        self._by_skiller: dict[str, list[tuple[int, int, dict[str, str]]]] = {}
        names = [_skiller(each) for each in model.interfaces]
        for place, (seq, _, number, changed) in enumerate(model.changes.items()):
            name = names[number]
            if name is not None:
                self._by_skiller.setdefault(name, []).append((seq, place, changed))

    def of(self, call: SkillCall, ordered: int) -> tuple[int | None, int | None]:
        """Return the places of the writes that told that a skill runs, and how it ended.

        The executive reads what was written before: the writes come before what it says of the skill.
        """
        begin = call.begin[0]
        began = [
            place
            for place, changed in self._between(call.skiller, ordered, begin)
            if changed.get("status") == RUNS or "msgid" in changed
        ]
        ended = [
            place
            for place, changed in self._between(call.skiller, begin, call.end[0] if call.end else begin)
            if changed.get("status") in ENDED
        ]
        return began[-1] if began else None, ended[-1] if ended else None

    def _between(self, skiller: str, after: int, before: int) -> list[tuple[int, dict[str, str]]]:
        """Return the changes between two events: their places, and what changed."""
        writes = self._by_skiller.get(skiller, [])
        first = bisect_right(writes, after, key=itemgetter(0))
        return [
            (place, changed)
            for _, place, changed in writes[first : bisect_left(writes, before, key=itemgetter(0))]
        ]


def _skiller(interface: InterfaceCount) -> str | None:
    """Return the Skiller whose interface it is."""
    kind, _, name = interface.uid.partition("::")
    return name if kind == "SkillerInterface" else None
