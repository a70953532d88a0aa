"""The last transition of each goal of a run, for its result."""

from __future__ import annotations

from typing import Final

from cxbridge.events import Event, GoalTransition
from cxbridge.executive.goals import GoalWatch
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
        self._last: dict[str, GoalTransition] = {}
        self._tidy_at = 2 * KEPT
        self.forgotten = 0

    def note(self, event: Event) -> None:
        """Take a transition."""
        if isinstance(event, GoalTransition):
            self._last[event.goal] = event
            if len(self._last) > self._tidy_at:
                self._forget()
                self._tidy_at = len(self._last) + KEPT

    def last(self) -> tuple[GoalTransition, ...]:
        """Return the last transition of each goal, in the order in which goals appeared."""
        self._forget()
        unnamed = self._last.get(NO_PARENT)
        if unnamed is not None and unnamed.mode == "FORMULATED" and NO_PARENT not in self._watch.open:
            del self._last[NO_PARENT]  # it has got an id
        return tuple(self._last.values())

    def _forget(self) -> None:
        gone = [name for name in self._last if name not in self._watch.open]
        for name in gone[:-KEPT]:
            del self._last[name]
            self.forgotten += 1
