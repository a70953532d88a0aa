"""Goals, their plans and plan-actions as tracks."""

from __future__ import annotations

from typing import Final

from cxbridge.history.builder import RunHistory
from cxbridge.history.model import DONE_STATES, ActionChange, GoalRecord, PlanActionRecord, goal_forest
from cxbridge_web.timeline.events import Lanes, Moment, TraceEvents, Track, Tracks

OPEN_NOTE: Final = "unfinished at the end of the recording"
"""The note of a slice that ends with the recording."""

DROPPED_NOTE: Final = "unfinished when its goal was retracted"
"""The note of a plan-action that ends with its goal."""

# The indentation of track names per level, since tracks cannot nest and blanks are trimmed.
INDENT: Final = "· "

MAX_DEPTH: Final = 12  # number of indented levels

_FORMULATED: Final = "FORMULATED"  # state of a plan-action before its begin


def add_goals(
    history: RunHistory, tracks: Tracks, events: TraceEvents, processes: dict[str, int]
) -> dict[int, Track]:
    """Add a track for each goal below the track of its parent, followed by the tracks of its plans.

    :param processes: the process of each environment.
    :returns: the tracks of plan-actions by number, without actions that never began.
    """
    action_tracks: dict[int, Track] = {}
    forest = goal_forest(history.goals)
    for number, depth in forest.walk():
        goal = history.goals[number]
        process, parent = processes[goal.env], forest.parents[number]
        track = tracks.add_track(process, f"{_indent(depth)}{goal.name} {goal.goal_class}")
        _add_goal(goal, "" if parent is None else history.goals[parent].name, history, events, track)
        for plan, actions in _group_by_plan(goal.actions).items():
            title = f"{_indent(depth + 1)}plan {plan}"
            action_tracks |= _add_plan(
                history, events, Lanes(tracks, process, title, is_numbered=True), actions
            )
    # A recording may lack the goal of an action, so the plan gets a track without a goal.
    actions_without_goal = [action for action in history.actions if action.goal_record is None]
    for plan, actions in _group_by_plan(actions_without_goal).items():
        lanes = Lanes(tracks, processes[actions[0].env], f"plan {plan}", is_numbered=True)
        action_tracks |= _add_plan(history, events, lanes, actions)
    return action_tracks


def _group_by_plan(actions: list[PlanActionRecord]) -> dict[str, list[PlanActionRecord]]:
    plans: dict[str, list[PlanActionRecord]] = {}
    for action in actions:
        plans.setdefault(action.plan, []).append(action)
    return plans


def _indent(depth: int) -> str:
    """Return the indentation of a track's name, limited for deep levels."""
    return INDENT * min(depth, MAX_DEPTH)


def _add_goal(goal: GoalRecord, parent: str, history: RunHistory, events: TraceEvents, track: Track) -> None:
    """Add a slice for each life of a goal, containing slices for its modes."""
    end = history.event_count, history.end
    begin: Moment | None = None
    # A goal may be retracted and formulated again with the same id: each life has a slice.
    for change, next_change in zip(goal.changes, [*goal.changes[1:], None], strict=True):
        moment = change.seq, change.time
        begin = begin or moment
        change_end = end if next_change is None else (next_change.seq, next_change.time)
        is_retracted = change.mode == "RETRACTED"
        outcome = {} if change.outcome == "UNKNOWN" else {"outcome": change.outcome}
        error = {"error": change.error} if change.error else {}
        name = f"{change.mode} {change.outcome}" if outcome else change.mode
        if not is_retracted:
            note = {} if next_change is not None else {"note": OPEN_NOTE}
            events.add_slice(
                track, name, moment, change_end, {**outcome, **error, **note}, category="mode", depth=1
            )
        if is_retracted or next_change is None:
            args = {
                "goal": goal.name,
                "class": goal.goal_class,
                "sub-type": goal.sub_type,
                "parent": parent,
            }
            note = {} if is_retracted else {"note": OPEN_NOTE}
            events.add_slice(
                track,
                f"{goal.name} {goal.goal_class}",
                begin,
                moment if is_retracted else end,
                {**args, **outcome, **error, **note},
                category="goal",
            )
            begin = None


def _add_plan(
    history: RunHistory, events: TraceEvents, lanes: Lanes, actions: list[PlanActionRecord]
) -> dict[int, Track]:
    """Add slices for a plan, its actions and their states; return the tracks of the actions.

    :param lanes: the tracks of the plan: overlapping actions get separate tracks.
    :param actions: the actions of the plan.
    """
    plan = actions[0].plan
    spans = [(span, action) for action in actions if (span := _find_span(action, history)) is not None]
    spans.sort(key=lambda span_and_action: span_and_action[0][0])
    begin = min(action.changes[0][:2] for action in actions)
    end = max([*(span[1] for span, _ in spans), *(action.changes[-1][:2] for action in actions)])
    unbegun_actions = [
        f"{action.id} {action.name}" for action in actions if _find_span(action, history) is None
    ]
    args = {
        "plan": plan,
        "actions": len(actions),
        **({"not begun": ", ".join(unbegun_actions)} if unbegun_actions else {}),
    }
    # The slice of the plan encloses its actions, so its track is not reserved: the first actions share it.
    events.add_slice(lanes.reserve_track(begin, begin), f"plan {plan}", begin, end, args, category="plan")
    action_tracks = {}
    for span, action in spans:
        action_tracks[action.number] = track = lanes.reserve_track(*span)
        _add_action(
            action, events, track, span, DROPPED_NOTE if span[1][0] < history.event_count else OPEN_NOTE
        )
    return action_tracks


def _find_span(action: PlanActionRecord, history: RunHistory) -> tuple[Moment, Moment] | None:
    """Return the start of an action, when it left FORMULATED, and its end; None if it never began."""
    # the first two fields of a change are its moment
    begin = next((change[:2] for change in action.changes if change.state != _FORMULATED), None)
    if begin is None:
        return None
    last_change = action.changes[-1]
    if last_change.state in DONE_STATES:
        return begin, last_change[:2]
    return begin, _find_retraction(action, last_change) or (history.event_count, history.end)


def _find_retraction(action: PlanActionRecord, last_change: ActionChange) -> Moment | None:
    """Return the moment when the goal was retracted after the action's last change; None if it was not."""
    if action.goal_record is None:
        return None
    changes = action.goal_record.changes
    return next(
        (change[:2] for change in changes if change.seq > last_change.seq and change.mode == "RETRACTED"),
        None,
    )


def _add_action(
    action: PlanActionRecord, events: TraceEvents, track: Track, span: tuple[Moment, Moment], note_text: str
) -> None:
    """Add a slice for an action, containing slices for its states.

    :param note_text: the note of an unfinished action.
    """
    begin, end = span
    note = {} if action.state in DONE_STATES else {"note": note_text}
    args = {"action": action.name, "id": action.id, "goal": action.goal, "plan": action.plan}
    name = f"{action.id} {action.name}"
    events.add_slice(
        track, name, begin, end, {**args, "state": action.state, **note}, category="action", depth=1
    )
    state_ends = [*(change[:2] for change in action.changes[1:]), end]
    for (seq, time, state), change_end in zip(action.changes, state_ends, strict=True):
        if seq >= begin[0] and seq < end[0]:
            events.add_slice(track, state, (seq, time), change_end, {}, category="state", depth=2)
