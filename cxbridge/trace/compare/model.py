"""The result of a comparison: the differences, and the events, rules and goals around them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View


class Order(Enum):
    """The order in which events must be equal; docs/comparing.md defines both."""

    TOTAL = "total"
    PARTIAL = "partial"


_Choice = TypeVar("_Choice", bound=Enum)


def parse_choice(enumeration: type[_Choice], name: str, value: str) -> _Choice:
    """Return the member of an enumeration that an option or argument names.

    :param name: the name of the option or argument.
    :raises TraceError: if there is no such member.
    """
    try:
        return enumeration(value)
    except ValueError:
        values = ", ".join(str(member.value) for member in enumeration)
        raise TraceError(f"invalid value for {name}: '{value}' is not one of {values}") from None


class DifferenceKind(Enum):
    """The kinds of differences; docs/comparing.md describes them."""

    CHANGED = "changed"
    ONLY_A = "only-a"
    ONLY_B = "only-b"
    ORDER = "order"
    MSGID = "msgid"
    TIME = "time"
    COUNT = "count"


@dataclass(slots=True)
class Side:
    """The event of one run at a difference.

    :param position: the number of the event among the compared events, from 0; for a missing event the number
        of the preceding event, or None.
    :param text: the event as text, or the reason why the event is missing; empty until the event is read.
    """

    position: int | None
    text: str = ""

    @property
    def number(self) -> int | None:
        """The position from 1; None without a position."""
        return None if self.position is None else self.position + 1


@dataclass(slots=True)
class Difference:
    """One difference between two runs.

    :param what: the difference as text, such as the differing parts.
    :param subject: the goal, plan, Skiller or interface; empty until the event is read.
    :param count: the number of events that differ: events in a row, the events of a goal that only one run
        has, or by how many one run has an event more often.
    :param has_details: whether details, such as parameters, differ: the text of an event does not show them.
    """

    what: str
    subject: str
    a: Side
    b: Side
    kind: DifferenceKind = DifferenceKind.CHANGED
    count: int = 1
    has_details: bool = False

    @property
    def position(self) -> int:
        """The first position on either side, by which differences are sorted.

        An event that only one run has is sorted by its position in that run.
        """
        if self.kind in {DifferenceKind.ONLY_A, DifferenceKind.ONLY_B}:
            side = self.a if self.kind is DifferenceKind.ONLY_A else self.b
            return side.position or 0
        return min(side.position for side in (self.a, self.b) if side.position is not None)


def sort_differences(differences: Iterable[Difference]) -> list[Difference]:
    """Return differences by position."""
    return sorted(differences, key=lambda difference: difference.position)


@dataclass(frozen=True, slots=True)
class EventLine:
    """A displayed event.

    :param number: the number of the event among the compared events, from 1.
    :param seconds: the time in seconds since the first event of the run.
    :param here: whether the event is at the difference.
    """

    number: int
    seconds: float
    text: str
    here: bool


@dataclass(frozen=True, slots=True)
class GoalAtDifference:
    """A goal at the difference.

    :param depth: the number of its ancestors.
    """

    depth: int
    goal: str
    goal_class: str
    mode: str
    outcome: str
    error: str

    @property
    def text(self) -> str:
        """The goal as an indented line."""
        outcome = "" if self.outcome == "UNKNOWN" else f" {self.outcome}"
        error = f" ({self.error})" if self.error else ""
        return f"{'  ' * self.depth}{self.goal} {self.goal_class} {self.mode}{outcome}{error}"


@dataclass(frozen=True, slots=True)
class DifferenceContext:
    """The events, rules and goals around a difference in one run.

    :param rules: the last firings up to the event at the difference, if the run records firings.
    :param goals: all goals except retracted roots and the goals below them, parents before their children.
    """

    lines: list[EventLine] = field(default_factory=list)
    rules: list[str] = field(default_factory=list)
    goals: list[GoalAtDifference] = field(default_factory=list)


@dataclass(slots=True)
class Comparison:
    """The result of a comparison.

    :param count_a: the number of compared events of the first run.
    :param count_b: the number of compared events of the second run.
    :param differences: in the order of the runs; empty for equal runs.
    :param other_index: among the runs compared with A, the index of the run that has these differences.
    """

    view: View
    order: Order
    count_a: int
    count_b: int
    differences: list[Difference] = field(default_factory=list)
    other_index: int = 0

    @property
    def same(self) -> bool:
        """Whether the runs are equal."""
        return not self.differences

    @property
    def hints(self) -> list[str]:
        """Advice to the user."""
        kinds = {difference.kind for difference in self.differences}
        if self.order is Order.TOTAL and kinds == {DifferenceKind.ORDER}:
            return ["only the order differs: compare with --order partial if the order does not matter"]
        return []
