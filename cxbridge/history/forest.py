"""Trees of goals.

The parent of a goal is the id in a slot that any rule may set: to ``nil``, to an unknown goal, to the goal
itself, or in a ring. A :class:`Forest` has no rings. The code avoids recursion, because goals may be nested
thousands deep.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from typing import Final, Generic, TypeVar

NO_PARENT: Final = "nil"
"""The slot ``parent`` of a root goal; a goal with the id ``nil`` has no sub-goals."""

Key = TypeVar("Key", bound=Hashable)


def parent_id(slot_value: str) -> str | None:
    """Return the id in the slot ``parent``, or None for a root."""
    return None if slot_value in ("", NO_PARENT) else slot_value


class Forest(Generic[Key]):
    """Goals as trees; in a ring of parents the goal that appeared first becomes a root.

    :param parents: the parent in each goal's slot; None for a root. The parents may be unknown goals, or form
        rings.
    :ivar parents: the parent of each goal in the trees; None for a root.
    :ivar roots: the goals without a parent, in order.
    :ivar children: the sub-goals in order, by goal; goals without sub-goals are omitted.
    """

    def __init__(self, parents: Mapping[Key, Key | None]) -> None:
        self.parents: dict[Key, Key | None] = {
            goal: parent if parent in parents else None for goal, parent in parents.items()
        }
        self._cut_rings()
        self.roots: list[Key] = []
        self.children: dict[Key, list[Key]] = {}
        for goal, parent in self.parents.items():
            if parent is None:
                self.roots.append(goal)
            else:
                self.children.setdefault(parent, []).append(goal)

    def _cut_rings(self) -> None:
        """Make the first goal of each ring of parents a root."""
        rank = {goal: number for number, goal in enumerate(self.parents)}
        settled: set[Key] = set()
        for start in self.parents:
            path: dict[Key, None] = {}  # an ordered set
            goal: Key | None = start
            while goal is not None and goal not in settled and goal not in path:
                path[goal] = None
                goal = self.parents[goal]
            # the path has reached one of its own goals: from this goal on, the path is a ring
            if goal in path:
                ring_path = list(path)
                self.parents[min(ring_path[ring_path.index(goal) :], key=rank.__getitem__)] = None
            settled.update(path)

    def walk(self, roots: Iterable[Key] | None = None) -> Iterator[tuple[Key, int]]:
        """Yield goals with their depth, parents before their children.

        :param roots: the goals to start from; None: all roots.
        """
        stack = [(goal, 0) for goal in reversed(list(self.roots if roots is None else roots))]
        while stack:
            goal, depth = stack.pop()
            yield goal, depth
            stack += [(child, depth + 1) for child in reversed(self.children.get(goal, []))]

    def goals_with_ancestors(self, goals: Iterable[Key]) -> set[Key]:
        """Return the goals and all their ancestors."""
        collected: set[Key] = set()
        for goal in goals:
            ancestor: Key | None = goal
            while ancestor is not None and ancestor not in collected:
                collected.add(ancestor)
                ancestor = self.parents[ancestor]
        return collected
