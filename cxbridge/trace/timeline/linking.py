"""Which skill a plan-action ran, and which writes of the Skiller's interface told of it.

A recording does not say it in so many words. An action goes from WAITING to RUNNING because the executive
saw its skill run: an action that waited when a skill began, and went to RUNNING before it was over, is the
one. Of several that could be, those of the skill's name go first, then the one that waited longest.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from cxbridge.trace.report.model import Action, InterfaceCount, RunModel, SkillCall

WAITING = frozenset({"PENDING", "WAITING"})
RUNNING = "RUNNING"
ENDED = frozenset({"S_FINAL", "S_FAILED"})


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


def links(model: RunModel) -> list[Link]:
    """Return the skills whose actions are known, in order."""
    runs = [
        (before[0], before[1], state[0], action)
        for action in model.actions
        for before, state in zip(action.states, action.states[1:], strict=False)
        if state[2] == RUNNING and before[2] in WAITING
    ]
    runs.sort(key=lambda run: run[2])
    ran_at = [run[2] for run in runs]
    writes = _Writes(model)
    taken: set[tuple[int, int]] = set()
    found = []
    for call in model.calls:
        limit = call.end[0] if call.end is not None else model.events
        after = slice(bisect_right(ran_at, call.begin[0]), bisect_right(ran_at, limit))
        could = [
            (action.name != _name(call.skill_string), seq, time, ran, action)
            for seq, time, ran, action in runs[after]
            if seq < call.begin[0] and action.env == call.env and (action.number, ran) not in taken
        ]
        if could:
            _, seq, time, ran, action = min(could, key=lambda each: each[:2])
            taken.add((action.number, ran))
            found.append(Link(action, call, (seq, time), *writes.of(call, seq)))
    return found


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
                self._by_skiller.setdefault(name, []).append((place, seq, changed))

    def of(self, call: SkillCall, ordered: int) -> tuple[int | None, int | None]:
        """Return the places of the writes that told that a skill runs, and how it ended.

        The executive reads what was written before: the writes come before what it says of the skill.
        """
        began = ended = None
        stop = call.end[0] if call.end is not None else None
        for place, seq, changed in self._by_skiller.get(call.skiller, []):
            status = changed.get("status")
            if ordered < seq < call.begin[0] and (status == "S_RUNNING" or "msgid" in changed):
                began = place
            if stop is not None and call.begin[0] < seq < stop and status in ENDED:
                ended = place
        return began, ended


def _skiller(interface: InterfaceCount) -> str | None:
    """Return the Skiller whose interface it is."""
    kind, _, name = interface.uid.partition("::")
    return name if kind == "SkillerInterface" else None
