"""What a comparison finds."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from cxbridge.trace.levels import View


class Order(Enum):
    """What of the order of events must be the same; docs/trace-model.md defines both."""

    TOTAL = "total"
    PARTIAL = "partial"


@dataclass(frozen=True, slots=True)
class Side:
    """What one of the two runs has at a difference.

    :param position: the number, among the events of the view, from 0, of the event at the difference, or of
        the last one before it when something is missing; None when there is none either.
    :param text: what counts of it, or why there is nothing.
    """

    position: int | None
    text: str


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two runs.

    :param what: what differs, in words.
    :param subject: the goal, plan, skiller or interface it is about; empty when it is about the whole run.
    """

    what: str
    subject: str
    a: Side
    b: Side

    @property
    def position(self) -> int:
        """Where it comes first, on either side: differences are sorted by it."""
        return min(side.position for side in (self.a, self.b) if side.position is not None)


@dataclass(slots=True)
class Comparison:
    """The outcome of a comparison.

    :param count_a: how many events of the view the first run has; ``count_b``: the second.
    :param differences: those found, the first in the runs first; empty when the runs are the same.
    :param other: which of the runs compared with shows the differences, from 0.
    """

    view: View
    order: Order
    count_a: int
    count_b: int
    differences: list[Difference] = field(default_factory=list)
    other: int = 0

    @property
    def same(self) -> bool:
        """Whether the runs are the same."""
        return not self.differences
