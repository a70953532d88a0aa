"""Lookup of the writes of a Skiller's interface that belong to a skill."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from operator import itemgetter

from cxbridge.history.builder import ENDED, RUNNING
from cxbridge.history.model import SkillExecution
from cxbridge_web.timeline.model import InterfaceCount, RunModel


class SkillerWrites:
    """The changes of each Skiller's interface, by index in :attr:`RunModel.changes`."""

    def __init__(self, model: RunModel) -> None:
        self._by_skiller: dict[str, list[tuple[int, int, dict[str, str]]]] = {}
        names = [_skiller(each) for each in model.interfaces]
        for index, (seq, _, number, changed) in enumerate(model.changes.items()):
            name = names[number]
            if name is not None:
                self._by_skiller.setdefault(name, []).append((seq, index, changed))

    def of(self, call: SkillExecution, ordered: int) -> tuple[int | None, int | None]:
        """Return the indices of the writes that reported a skill's begin and end.

        The executive reads earlier writes, so they precede its own events about the skill.
        """
        begin = call.begin[0]
        began = [
            index
            for index, changed in self._between(call.skiller, ordered, begin)
            if changed.get("status") == RUNNING or "msgid" in changed
        ]
        ended = [
            index
            for index, changed in self._between(call.skiller, begin, call.end[0] if call.end else begin)
            if changed.get("status") in ENDED
        ]
        return began[-1] if began else None, ended[-1] if ended else None

    def _between(self, skiller: str, after: int, before: int) -> list[tuple[int, dict[str, str]]]:
        """Return the changes between two events: index and changed fields."""
        writes = self._by_skiller.get(skiller, [])
        first = bisect_right(writes, after, key=itemgetter(0))
        return [
            (index, changed)
            for _, index, changed in writes[first : bisect_left(writes, before, key=itemgetter(0))]
        ]


def _skiller(interface: InterfaceCount) -> str | None:
    kind, _, name = interface.uid.partition("::")
    return name if kind == "SkillerInterface" else None
