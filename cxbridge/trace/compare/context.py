"""The context of a difference: the events around it, the last fired rules and the present goals."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence

from cxbridge.clock import MICROSECONDS
from cxbridge.event_kinds import View
from cxbridge.events import Event, GoalTransition, RuleFired
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.model import DifferenceContext, EventLine, GoalAtDifference
from cxbridge.trace.compare.selection import Selection, events_with_content
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe_event

LINES_BEFORE = 6
"""The number of events shown before the event at the difference."""

LINES_AFTER = 2
"""The number of events shown after the event at the difference."""

RULES_SHOWN = 5
"""The maximum number of firings shown; the last may be the event at the difference itself."""


def read_contexts(
    run: Run, view: View, positions: Sequence[int | None], selection: Selection | None = None
) -> dict[int | None, DifferenceContext]:
    """Read a run once, and return the context of each of several events.

    :param positions: the numbers of the events among the compared events, from 0; None has an empty context.
    """
    contexts: dict[int | None, DifferenceContext] = {position: DifferenceContext() for position in positions}
    positions_in_order = sorted(position for position in contexts if position is not None)
    if not positions_in_order:
        return contexts
    recent: deque[tuple[int, Event]] = deque(maxlen=LINES_BEFORE + 1)
    rules: deque[RuleFired] = deque(maxlen=RULES_SHOWN)
    goals: dict[str, GoalTransition] = {}
    incomplete_positions: list[int] = []
    number, start_us = 0, None
    for event, content in events_with_content(run, view, selection):
        start_us = event.time_us if start_us is None else start_us
        # goals and rules count even if the selection leaves them out
        if type(event) is GoalTransition:
            goals[event.goal] = event
        elif type(event) is RuleFired:
            rules.append(event)
        if content is None:
            continue
        recent.append((number, event))
        incomplete_positions = [
            position for position in incomplete_positions if number <= position + LINES_AFTER
        ]
        for position in incomplete_positions:
            contexts[position].lines.append(event_line(number, event, start_us))
        if number in contexts:
            lines = [
                event_line(recent_number, recent_event, start_us, here=recent_number == number)
                for recent_number, recent_event in recent
            ]
            contexts[number] = DifferenceContext(
                lines, [describe_event(rule) for rule in rules], [*goals_at_difference(goals)]
            )
            incomplete_positions.append(number)
        # all contexts are complete, and the rest of the run may be long
        if number == positions_in_order[-1] + LINES_AFTER:
            break
        number += 1
    return contexts


def event_line(number: int, event: Event, start_us: int, *, here: bool = False) -> EventLine:
    """Return a displayed event.

    :param number: the number of the event among the compared events, from 0.
    :param start_us: the start of the run in microseconds.
    :param here: whether the event is at the difference.
    """
    return EventLine(number + 1, (event.time_us - start_us) / MICROSECONDS, describe_event(event), here)


def goals_at_difference(goals: Mapping[str, GoalTransition]) -> Iterator[GoalAtDifference]:
    """Yield the goals as a tree; retracted roots are left out with their sub-goals."""
    forest = Forest({name: parent_id(goal.parent) for name, goal in goals.items()})
    for name, depth in forest.walk(name for name in forest.roots if goals[name].mode != "RETRACTED"):
        goal = goals[name]
        yield GoalAtDifference(depth, goal.goal, goal.goal_class, goal.mode, goal.outcome, goal.error)
