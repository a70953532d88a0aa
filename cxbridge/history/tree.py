"""Goal trees as lines of text."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from typing import Final, Protocol, TypeVar

from msgspec import Struct

from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.outcome import OutcomeKind, goal_outcome

Key = TypeVar("Key", bound=Hashable)
Line = TypeVar("Line")

# Rules that fire endlessly make thousands of goals, and the verdict after the tree must stay in sight.
MAX_PRINTED_LINES: Final = 200


class TreeGoal(Protocol):
    """The slots of a goal that a line of a tree shows."""

    @property
    def goal_class(self) -> str: ...

    @property
    def mode(self) -> str: ...

    @property
    def outcome(self) -> str:
        """The outcome; empty or ``UNKNOWN`` before the end."""

    @property
    def error(self) -> str:
        """The reason for a failure; empty without a failure."""


class NamedGoal(TreeGoal, Protocol):
    """A goal with id and parent."""

    @property
    def goal(self) -> str:
        """The id."""

    @property
    def parent(self) -> str:
        """The id in the slot ``parent``."""


class GoalLine(Struct, frozen=True):
    """A line of a goal tree.

    :param branch: the lines of the tree to the left.
    :param title: the id and class of the goal.
    :param state: the outcome, or the mode if there is no outcome; both with ``show_modes``.
    """

    branch: str
    title: str
    outcome: OutcomeKind
    state: str
    error: str

    @property
    def text(self) -> str:
        """The line without colours."""
        return f"{self.branch}{self.title}: {self.state}{f'  [{self.error}]' if self.error else ''}"


def goal_title(goal: str, goal_class: str) -> str:
    """Return id and class of a goal."""
    return f"{goal} ({goal_class})"


def goal_as_json(goal: NamedGoal) -> dict[str, str]:
    """Return a goal as an object for JSON."""
    return {
        "id": goal.goal,
        "class": goal.goal_class,
        "parent": goal.parent,
        "mode": goal.mode,
        "outcome": goal.outcome,
        "error": goal.error,
    }


def goal_line(branch: str, name: str, goal: TreeGoal, *, show_modes: bool = False) -> GoalLine:
    """Return a goal as a line of a tree.

    :param name: the id in the title.
    :param show_modes: whether to show the mode also next to an outcome.
    """
    has_outcome = goal.outcome not in ("UNKNOWN", "")
    mode = f"{goal.mode} " if show_modes or not has_outcome else ""
    state = f"{mode}{goal.outcome if has_outcome else ''}".rstrip()
    return GoalLine(
        branch, goal_title(name, goal.goal_class), goal_outcome(goal.mode, goal.outcome), state, goal.error
    )


def goal_lines(goals: Iterable[NamedGoal], *, show_modes: bool = False) -> Iterator[GoalLine]:
    """Yield goals as trees, parents before their children; see :func:`goal_line`.

    :param goals: the goals in the order of appearance. Goals with the same id are the lives of this id; the
        second life has the title ``ID#2 (CLASS)``.
    """
    goals_by_number = list(goals)
    numbers_by_id: dict[str, list[int]] = {}
    for number, goal in enumerate(goals_by_number):
        numbers_by_id.setdefault(goal.goal, []).append(number)
    parents: dict[int, int | None] = {}
    for number, goal in enumerate(goals_by_number):
        parent_numbers = numbers_by_id.get(parent_id(goal.parent) or "", [])
        # the parent's last life before the goal; its first life if the goal names its parent in advance
        earlier_numbers = [parent_number for parent_number in parent_numbers if parent_number < number]
        parents[number] = next(iter(earlier_numbers[-1:] or parent_numbers), None)
    for number, branch in draw_branches(Forest(parents)):
        goal = goals_by_number[number]
        life = numbers_by_id[goal.goal].index(number) + 1
        yield goal_line(
            branch, goal.goal if life == 1 else f"{goal.goal}#{life}", goal, show_modes=show_modes
        )


def latest_lines(lines: Iterable[Line]) -> Iterator[Line | str]:
    """Yield the last :data:`MAX_PRINTED_LINES` lines of a tree, after the number of the earlier lines."""
    printed_lines = list(lines)
    if earlier_lines := printed_lines[:-MAX_PRINTED_LINES]:
        yield f"({len(earlier_lines)} earlier lines of goals are not printed)"
    yield from printed_lines[-MAX_PRINTED_LINES:]


def draw_branches(forest: Forest[Key]) -> Iterator[tuple[Key, str]]:
    """Yield the goals of a forest with the branches to their left, parents before their children."""
    stems: list[str] = []  # the lines before the children of the ancestors

    for goal, depth in forest.walk():
        # leave the subtree of the previous goal
        del stems[depth:]
        parent = forest.parents[goal]
        if parent is None:
            branch, stem = "", ""
        else:
            is_last = goal == forest.children[parent][-1]
            branch, stem = ("└─ ", "   ") if is_last else ("├─ ", "│  ")
        stem_above = stems[-1] if stems else ""
        yield goal, stem_above + branch
        stems.append(stem_above + stem)
