"""The last that was seen of each goal of a run, for its result."""

from __future__ import annotations

from typing import Final

from cxbridge.events import Event, GoalTransition
from cxbridge.executive.goals import GoalState, GoalWatch
from cxbridge.history.forest import NO_PARENT

KEPT: Final = 10_000
"""So many goals that are gone are listed, the last ones; a run may be long."""


class GoalHistory:
    """Remembers goals.

    :param watch: who knows which goals are there.
    :ivar forgotten: how many goals that are gone are not listed any more.
    """

    def __init__(self, watch: GoalWatch) -> None:
        self._watch = watch
        self._states: dict[str, GoalState] = {}
        self._tidy_at = 2 * KEPT
        self.forgotten = 0

    def note(self, event: Event) -> None:
        """Take a transition."""
        if isinstance(event, GoalTransition):
            self._states[event.goal] = GoalState(
                event.goal, event.goal_class, event.parent, event.mode, event.outcome, event.error, ""
            )
            if len(self._states) > self._tidy_at:
                self._forget()
                self._tidy_at = len(self._states) + KEPT

    def states(self) -> tuple[GoalState, ...]:
        """Return the goals in the order they appeared."""
        self._forget()
        unnamed = self._states.get(NO_PARENT)
        if unnamed is not None and unnamed.mode == "FORMULATED" and NO_PARENT not in self._watch.open:
            del self._states[NO_PARENT]  # it has got an id
        return tuple(self._states.values())

    def _forget(self) -> None:
        gone = [name for name in self._states if name not in self._watch.open]
        for name in gone[:-KEPT]:
            del self._states[name]
            self.forgotten += 1
