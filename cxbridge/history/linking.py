"""Pairs plan-actions with the skills that executed them.

The executive says with which message it has sent a plan-action. Fawkes' logs without facts and files of older
versions do not: for them alone the pairs are guessed, here and nowhere else.

The guess: the executive sees the skill run, and lets the action go from WAITING to RUNNING; it sees the skill
end, and the action ends. So an action that waited when a skill began may be the one, if it went to RUNNING
before the skill was over. Where facts are recorded they tell which Skiller an action is for, and its
arguments: then it is one of those for that Skiller, and the one with most of its arguments in the skill
string. Of several it is the one that ended when the skill did, then one that is called like the skill, then
the one that waited longest.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

from cxbridge.history.builder import RunHistory
from cxbridge.history.model import PlanActionRecord, SkillExecution
from cxbridge.history.transitions import NOT_SENT

_NAME_ENDS = re.compile(r"[\s({]")

WAITING = frozenset({"PENDING", "WAITING"})
RUNNING = "RUNNING"

SAME_US = 100_000
"""Ends of an action and a skill that are less apart prove nothing: the executive looks now and then."""


@dataclass(frozen=True, slots=True)
class SkillLink:
    """A plan-action and its skill.

    :param ordered: seq and time when the action began to wait for the skill.
    :param guessed: the recording does not say that they belong together.
    """

    action: PlanActionRecord
    call: SkillExecution
    ordered: tuple[int, int]
    guessed: bool = False

    @property
    def word(self) -> str:
        """A word before the skill of the action: empty, or ``probably`` and a blank."""
        return "probably " if self.guessed else ""


@dataclass(frozen=True, slots=True)
class _Wait:
    """An action that waited, and then ran.

    :param ordered: seq and time of its last state before it ran. ``ran``: seq when it ran.
    :param over: time when it ran no more, None when that is not recorded.
    """

    action: PlanActionRecord
    ordered: tuple[int, int]
    ran: int
    over: int | None


def links(history: RunHistory) -> list[SkillLink]:
    """Return the skills whose actions are known, in order. Of several agents each says it, or does not."""
    saying = {action.env for action in history.actions if action.sent}
    found = [*_said(history), *_guessed(history, saying)]
    return sorted(found, key=lambda link: link.call.begin)


def _said(history: RunHistory) -> Iterator[SkillLink]:
    """Yield the pairs that the executive says.

    Numbers may be used again: the last call before counts, but for one from before the action was sent.
    """
    calls: dict[tuple[str, str], list[SkillExecution]] = {}
    for call in history.calls:
        calls.setdefault(call.sent_as, []).append(call)
    for action in history.actions:
        for seq, skiller, number in action.sent:
            begun = [
                call
                for call in calls.get((skiller, number), ())
                if call.begin[0] < seq and call.env in ("", action.env)
            ]
            pending = [
                change.seq for change in action.changes if change.seq < seq and change.state in NOT_SENT
            ]
            if begun and begun[-1].begin[0] >= max(pending, default=0):
                before = [change[:2] for change in action.changes if change.seq < begun[-1].begin[0]]
                yield SkillLink(action, begun[-1], before[-1] if before else action.changes[0][:2])


def _guessed(history: RunHistory, saying: Collection[str]) -> Iterator[SkillLink]:
    """Yield the most likely pairs of the environments that name none.

    :param saying: the environments that name them.
    """
    waits = [wait for wait in _waits(history) if wait.action.env not in saying]
    waits.sort(key=lambda wait: wait.ran)
    ran_at = [wait.ran for wait in waits]
    skillers = {call.skiller for call in history.calls}
    taken: set[tuple[int, int]] = set()
    for call in history.calls if waits else ():
        limit = call.end[0] if call.end is not None else history.events
        could = [
            wait
            for wait in waits[bisect_right(ran_at, call.begin[0]) : bisect_right(ran_at, limit)]
            if wait.ordered[0] < call.begin[0]
            and call.env in ("", wait.action.env)
            # a name that is not a Skiller's here says nothing: a robot's, where one Skiller serves them all
            and (wait.action.order.skiller == call.skiller or wait.action.order.skiller not in skillers)
            and (wait.action.number, wait.ran) not in taken
        ]
        if could:
            wait = min(could, key=partial(_unlikely, call, history.end))
            taken.add((wait.action.number, wait.ran))
            yield SkillLink(wait.action, call, wait.ordered, guessed=True)


def _waits(history: RunHistory) -> Iterator[_Wait]:
    """Yield how actions waited for skills."""
    for action in history.actions:
        changes = action.changes
        for place, (before, change) in enumerate(pairwise(changes)):
            if change.state == RUNNING and before.state in WAITING:
                after = changes[place + 2 : place + 3]
                yield _Wait(action, before[:2], change.seq, after[0].time if after else None)


def _unlikely(call: SkillExecution, end: int, wait: _Wait) -> tuple[int, int, bool, int]:
    """Return what says that an action ran another skill: the less, the better."""
    over = call.end[1] if call.end is not None else end
    gap = abs((end if wait.over is None else wait.over) - over)
    mentioned = wait.action.order.count_in(call.skill_string)
    return -mentioned, gap // SAME_US, wait.action.name != _name(call.skill_string), wait.ordered[0]


def _name(skill_string: str) -> str:
    """Return the name of the skill that a skill string calls, or that an executor executes."""
    return _NAME_ENDS.split(skill_string, maxsplit=1)[0]
