"""The result of a comparison: differences, the events around them, and what does not count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from cxbridge.event_kinds import View

MAX_DIFFERENCES: Final = 1000
"""How many differences are kept."""


class Order(Enum):
    """What of the order of events must be the same; docs/comparing.md defines both."""

    TOTAL = "total"
    PARTIAL = "partial"


class DifferenceKind(Enum):
    """The sorts of differences."""

    CHANGED = "changed"
    ONLY_A = "only-a"
    ONLY_B = "only-b"
    ORDER = "order"
    MSGID = "msgid"
    TIME = "time"
    COUNT = "count"


@dataclass(frozen=True, slots=True)
class Side:
    """The event of one of the two runs at a difference.

    :param position: the number, among the events that are compared, from 0, of the event at the difference,
        or of the last one before it when something is missing; None when there is none either.
    :param text: what counts of it, or why there is nothing.
    """

    position: int | None
    text: str

    @property
    def number(self) -> int | None:
        """The position as people count, from 1."""
        return None if self.position is None else self.position + 1


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two runs.

    :param what: what differs, in words.
    :param subject: the goal, plan, skiller or interface it is about; empty when it is about the whole run.
    :param count: how many events in a row it is about.
    """

    what: str
    subject: str
    a: Side
    b: Side
    kind: DifferenceKind = DifferenceKind.CHANGED
    count: int = 1

    @property
    def position(self) -> int:
        """Where it comes first, on either side: differences are sorted by it.

        The surplus of one run comes up where that run has it.
        """
        if self.kind in {DifferenceKind.ONLY_A, DifferenceKind.ONLY_B}:
            side = self.a if self.kind is DifferenceKind.ONLY_A else self.b
            return side.position or 0
        return min(side.position for side in (self.a, self.b) if side.position is not None)


@dataclass(frozen=True, slots=True)
class EventLine:
    """An event that is shown.

    :param number: its number among those that are compared, from 1.
    :param seconds: time since the first event of the run.
    :param here: whether it is the one at the difference.
    """

    number: int
    seconds: float
    text: str
    here: bool


@dataclass(frozen=True, slots=True)
class GoalAtDifference:
    """A goal at the difference.

    :param depth: how many goals are above it.
    """

    depth: int
    goal: str
    goal_class: str
    mode: str
    outcome: str
    error: str

    @property
    def text(self) -> str:
        """The goal on one line, indented."""
        outcome = "" if self.outcome == "UNKNOWN" else f" {self.outcome}"
        error = f" ({self.error})" if self.error else ""
        return f"{'  ' * self.depth}{self.goal} {self.goal_class} {self.mode}{outcome}{error}"


@dataclass(frozen=True, slots=True)
class DifferenceContext:
    """What led to a difference on one side.

    :param lines: the events around it.
    :param rules: the firings just before it, when the run has firings.
    :param goals: the goals that are not retracted at that point, parents before their children.
    """

    lines: list[EventLine] = field(default_factory=list)
    rules: list[str] = field(default_factory=list)
    goals: list[GoalAtDifference] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class AlignedRow:
    """Two events next to each other: partners, or one that has none.

    :param same: whether both exist and are equal.
    """

    a: EventLine | None
    b: EventLine | None
    same: bool


@dataclass(slots=True)
class Comparison:
    """The outcome of a comparison.

    :param count_a: how many events of the view the first run has; ``count_b``: the second.
    :param differences: those found, the first in the runs first; empty when the runs are the same.
    :param other: which of the runs compared with shows the differences, from 0.
    :param dropped: how many more differences there are than are kept.
    :param rows: both runs next to each other around the first difference; may be empty.
    :param alike: the part of the events that have a partner, from 0 to 1; None when it was not counted.
    :param hints: hints for a person about the difference.
    """

    view: View
    order: Order
    count_a: int
    count_b: int
    differences: list[Difference] = field(default_factory=list)
    other: int = 0
    dropped: int = 0
    rows: list[AlignedRow] = field(default_factory=list)
    alike: float | None = None
    hints: list[str] = field(default_factory=list)

    def keep(self, found: list[Difference]) -> None:
        """Take the differences that were found, in order; count those that are too many to keep."""
        self.differences = found[:MAX_DIFFERENCES]
        self.dropped += len(found) - len(self.differences)

    @property
    def same(self) -> bool:
        """Whether the runs are the same."""
        return not self.differences and not self.dropped

    @property
    def total(self) -> int:
        """How many differences there are."""
        return len(self.differences) + self.dropped


def ends_early(differences: Sequence[Difference], count_a: int, count_b: int) -> list[str]:
    """Return a hint when one run has all events of the other up to its end, and the other continues."""
    for kind, count, short, long in (
        (DifferenceKind.ONLY_A, count_b, "B", "A"),
        (DifferenceKind.ONLY_B, count_a, "A", "B"),
    ):
        if differences and all(each.kind is kind and each.position >= count for each in differences):
            return [f"{short} ends after its event {count}, {long} goes on"]
    return []
