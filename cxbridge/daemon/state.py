"""The state of a daemon for clients: goals, plan-actions, skills and the log, in one answer."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from itertools import count, islice
from typing import TYPE_CHECKING, Any, Final

from cxbridge.events import Event, EventBus, LogLine, SkillStatus
from cxbridge.executive.host.values import show
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.keeping import cut
from cxbridge.history.tree import plain_goal

if TYPE_CHECKING:
    from cxbridge.daemon.nodes import ExecutiveNode
    from cxbridge.mainloop import MainLoop

MOST_GOALS: Final = 400
MOST_ACTIONS: Final = 400
MOST_LINES: Final = 200
"""Goals, plan-actions and log lines in an answer; so many lines are remembered."""

_TEXT: Final = 200


class DaemonState:
    """Gathers the state of the daemon.

    :param bus: has the log and the skills.
    :param node: the executive; None: there shall be none.
    :param loop: whose loops are counted.
    """

    def __init__(self, bus: EventBus, node: ExecutiveNode | None, loop: MainLoop | None = None) -> None:
        self._clock = bus.clock
        self._node = node
        self._loop = loop
        self._lines: deque[tuple[int, str, str, str]] = deque(maxlen=MOST_LINES)
        self._numbers = count(1)
        self._lock = threading.Lock()
        self._skills: dict[str, tuple[str, str]] = {}
        bus.subscribe(self._take, LogLine, SkillStatus)

    def _take(self, event: Event) -> None:
        if isinstance(event, LogLine):
            with self._lock:  # those who ask for what is behind a number shall miss none before it
                line = (next(self._numbers), event.level.value, event.component, cut(event.text, _TEXT))
                self._lines.append(line)
        elif isinstance(event, SkillStatus):
            self._skills[event.skiller] = (cut(event.skill_string, _TEXT), event.status)

    def describe(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return it, as JSON can have it.

        :param given: ``since``: of the log what is behind this line number. ``goals``: so many at most,
            :data:`MOST_GOALS` by default. ``words``: only goals with this in them, and those above them.
        """
        since, most = int(given.get("since", 0)), int(given.get("goals", MOST_GOALS))
        goals = self._goals(str(given.get("words", "")).lower())
        return {
            "time_us": self._clock.now_us(),
            "loops": 0 if self._loop is None else self._loop.loops,
            "goals": goals[:most],
            "more_goals": max(0, len(goals) - most),
            "actions": self._actions(),
            "skills": [[skiller, *status] for skiller, status in sorted(self._skills.items())],
            "log": [line for line in tuple(self._lines) if line[0] > since],
        }

    def _goals(self, words: str) -> list[dict[str, str]]:
        """Return the goals that have these words, and those above them."""
        if self._node is None:
            return []
        rows = {
            goal.goal: plain_goal(goal) | {"error": cut(goal.error, _TEXT)}
            for goal in self._node.goals.values()
        }
        if not words:
            return list(rows.values())
        forest = Forest({goal: parent_id(row["parent"]) for goal, row in rows.items()})
        wanted = forest.with_those_above(
            goal for goal, row in rows.items() if words in " ".join(row.values()).lower()
        )
        return [row for goal, row in rows.items() if goal in wanted]

    def _actions(self) -> list[dict[str, str]]:
        """Return slots of the plan-actions there are."""
        env = None if self._node is None else self._node.env
        if env is None:
            return []
        with env.lock:
            return [
                {
                    slot: cut(show(slots.get(slot, "")), _TEXT)
                    for slot in ("goal-id", "plan-id", "id", "action-name", "param-values", "state")
                }
                for _, _, slots in islice(env.facts("plan-action"), MOST_ACTIONS)
            ]
