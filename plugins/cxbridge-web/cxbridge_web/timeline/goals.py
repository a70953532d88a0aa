"""Goals, their plans and plan-actions as tracks."""

from __future__ import annotations

from dataclasses import dataclass, field

from cxbridge.history.builder import RunHistory
from cxbridge.history.model import DONE_STATES, ActionChange, GoalRecord, PlanActionRecord, goal_forest
from cxbridge_web.timeline.events import Events, Moment, Track, Tracks

OPEN = "not over at the end of the recording"  # note of a slice that ends with the recording

DROPPED = "not over when its goal was retracted"  # note of a plan-action that ends with its goal

# The indentation of track names per level, since tracks cannot nest and blanks are trimmed.
INDENT = "· "

DEEPEST = 12  # limit of indented levels

NOT_BEGUN = "FORMULATED"


@dataclass(slots=True)
class GoalTracks:
    """The tracks of goals and plan-actions.

    :param actions: by plan-action number, except actions that never began.
    """

    goals: dict[int, Track] = field(default_factory=dict)
    actions: dict[int, Track] = field(default_factory=dict)


def add_goals(history: RunHistory, tracks: Tracks, events: Events, processes: dict[str, int]) -> GoalTracks:
    """Add a track for each goal below its parent's, followed by those of its plans.

    :param processes: the process of each environment.
    """
    placed = GoalTracks()
    forest = goal_forest(history.goals)
    for number, depth in forest.walk():
        goal = history.goals[number]
        process = processes[goal.env]
        track = tracks.thread(process, f"{_indent(depth)}{goal.name} {goal.goal_class}")
        placed.goals[number] = track
        above = forest.parents[number]
        _add_goal(goal, "" if above is None else history.goals[above].name, history, events, track)
        for plan, actions in _plans(goal.actions).items():
            _add_plan(history, tracks, events, placed, process, (plan, actions, depth + 1))
    for plan, actions in _plans([each for each in history.actions if each.goal_record is None]).items():
        _add_plan(history, tracks, events, placed, processes[actions[0].env], (plan, actions, 0))
    return placed


def _plans(actions: list[PlanActionRecord]) -> dict[str, list[PlanActionRecord]]:
    plans: dict[str, list[PlanActionRecord]] = {}
    for action in actions:
        plans.setdefault(action.plan, []).append(action)
    return plans


def _indent(depth: int) -> str:
    """Return the indentation of a track's name, limited for deep levels."""
    return INDENT * min(depth, DEEPEST)


def _add_goal(goal: GoalRecord, parent: str, history: RunHistory, events: Events, track: Track) -> None:
    """Add a slice for each life of a goal, containing slices for its modes."""
    end = history.events, history.end
    birth: Moment | None = None
    for state, after in zip(goal.changes, [*goal.changes[1:], None], strict=True):
        moment = state.seq, state.time
        birth = birth or moment
        until = end if after is None else (after.seq, after.time)
        is_retracted = state.mode == "RETRACTED"
        outcome = {} if state.outcome == "UNKNOWN" else {"outcome": state.outcome}
        error = {"error": state.error} if state.error else {}
        name = f"{state.mode} {state.outcome}" if outcome else state.mode
        if not is_retracted:
            note = {} if after is not None else {"note": OPEN}
            events.slice(track, name, moment, until, {**outcome, **error, **note}, category="mode", depth=1)
        if is_retracted or after is None:
            facts = {
                "goal": goal.name,
                "class": goal.goal_class,
                "sub-type": goal.sub_type,
                "parent": parent,
            }
            note = {} if is_retracted else {"note": OPEN}
            events.slice(
                track,
                f"{goal.name} {goal.goal_class}",
                birth,
                moment if is_retracted else end,
                {**facts, **outcome, **error, **note},
                category="goal",
            )
            birth = None


def _add_plan(
    history: RunHistory,
    tracks: Tracks,
    events: Events,
    placed: GoalTracks,
    process: int,
    plan: tuple[str, list[PlanActionRecord], int],
) -> None:
    """Add slices for a plan, its actions and their states.

    Overlapping actions get separate tracks.
    """
    name, actions, depth = plan
    title = f"{_indent(depth)}plan {name}"
    lanes: list[tuple[Track, int]] = [(tracks.thread(process, title), -1)]
    spans = [(span, action) for action in actions if (span := _span(action, history)) is not None]
    spans.sort(key=lambda each: each[0][0])
    first = min(action.changes[0][:2] for action in actions)
    ends = [span[1] for span, _ in spans]
    last = max([*ends, *(action.changes[-1][:2] for action in actions)])
    idle = [f"{action.id} {action.name}" for action in actions if _span(action, history) is None]
    facts = {"plan": name, "actions": len(actions), **({"not begun": ", ".join(idle)} if idle else {})}
    events.slice(lanes[0][0], f"plan {name}", first, last, facts, category="plan")
    for (begin, end), action in spans:
        lane = next((number for number, (_, busy) in enumerate(lanes) if busy <= begin[0]), None)
        if lane is None:
            lane = len(lanes)
            lanes.append((tracks.thread(process, f"{title} ({lane + 1})"), -1))
        track = lanes[lane][0]
        lanes[lane] = track, end[0]
        placed.actions[action.number] = track
        _add_action(action, events, track, (begin, end), DROPPED if end[0] < history.events else OPEN)


def _span(action: PlanActionRecord, history: RunHistory) -> tuple[Moment, Moment] | None:
    """Return when an action left FORMULATED and when it ended; None if it never began."""
    begin = next((change[:2] for change in action.changes if change.state != NOT_BEGUN), None)
    if begin is None:
        return None
    last = action.changes[-1]
    if last.state in DONE_STATES:
        return begin, last[:2]
    return begin, _retraction(action, last) or (history.events, history.end)


def _retraction(action: PlanActionRecord, last: ActionChange) -> Moment | None:
    """Return the retraction of an action's goal after its last change; None without one."""
    if action.goal_record is None:
        return None
    changes = action.goal_record.changes
    return next((each[:2] for each in changes if each.seq > last.seq and each.mode == "RETRACTED"), None)


def _add_action(
    action: PlanActionRecord, events: Events, track: Track, span: tuple[Moment, Moment], remark: str
) -> None:
    """Add a slice for an action, containing slices for its states.

    :param remark: the note of an unfinished action.
    """
    begin, end = span
    last = action.state
    note = {} if last in DONE_STATES else {"note": remark}
    facts = {"action": action.name, "id": action.id, "goal": action.goal, "plan": action.plan}
    name = f"{action.id} {action.name}"
    events.slice(track, name, begin, end, {**facts, "state": last, **note}, category="action", depth=1)
    ends = [*(change[:2] for change in action.changes[1:]), end]
    for (seq, time, state), until in zip(action.changes, ends, strict=True):
        if seq >= begin[0] and seq < end[0]:
            events.slice(track, state, (seq, time), until, {}, category="state", depth=2)
