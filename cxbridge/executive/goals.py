"""What becomes of the goals: the host follows them to know when a run is over, and how it ended."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass

from cxbridge.executive.environment import ClipsEnvironment

KEPT = 1000
"""Root goals that have ended and are remembered one by one; a daemon runs for long."""

_NO_PARENT = "nil"
_OVER = "RETRACTED"
_SLOTS = ("id", "class", "parent", "mode", "outcome", "error", "message")


@dataclass(frozen=True, slots=True)
class GoalState:
    """The last that was seen of a goal; texts as CLIPS prints them."""

    goal: str
    goal_class: str
    parent: str
    mode: str
    outcome: str
    error: str
    message: str

    @property
    def is_root(self) -> bool:
        """Whether it has no parent."""
        return self.parent == _NO_PARENT


class GoalWatch:
    """Follows the goals of an environment.

    :ivar open: goals whose facts are there, by id.
    :ivar ended: root goals that are retracted or gone, in that order; at most :data:`KEPT` of them.
    :ivar outcomes: how many root goals ended with which outcome.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self.open: dict[str, GoalState] = {}
        self.ended: deque[GoalState] = deque(maxlen=KEPT)
        self.outcomes: Counter[str] = Counter()
        self._gone: set[str] = set()
        self._over: set[str] = set()
        env.watcher.follow("goal", self._asserted, _SLOTS)
        env.watcher.follow_retractions("goal", self._retracted, ("id",))

    def _asserted(self, _template: str, slots: dict[str, str]) -> None:
        goal = slots["id"]
        self._gone.discard(goal)
        self.open[goal] = GoalState(
            goal,
            slots.get("class", ""),
            slots.get("parent", _NO_PARENT),
            slots.get("mode", ""),
            slots.get("outcome", ""),
            slots.get("error", ""),
            slots.get("message", ""),
        )

    def _retracted(self, _template: str, slots: dict[str, str]) -> None:
        self._gone.add(slots["id"])

    def settle(self) -> None:
        """Book what has ended. To be called between runs: a modify retracts and asserts within one."""
        for goal in self._gone:
            state = self.open.pop(goal, None)
            if state is not None and state.is_root and goal not in self._over:
                self._end(state)
            self._over.discard(goal)
        self._gone.clear()
        for state in self.roots:
            if state.mode == _OVER and state.goal not in self._over:
                self._over.add(state.goal)
                self._end(state)

    def _end(self, state: GoalState) -> None:
        self.ended.append(state)
        self.outcomes[state.outcome] += 1

    @property
    def roots(self) -> list[GoalState]:
        """The goals without a parent whose facts are there, in the order they appeared."""
        return [state for state in self.open.values() if state.is_root]

    @property
    def all_over(self) -> bool:
        """Whether there have been root goals and none is open."""
        return bool(self.outcomes) and all(root.goal in self._over for root in self.roots)
