"""Goals, their plans and plan-actions as tracks."""

from __future__ import annotations

from dataclasses import dataclass, field

from cxbridge.trace.report.model import Action, Goal, RunModel, parents
from cxbridge.trace.timeline.events import Events, Moment, Track, Tracks

OPEN = "not over at the end of the recording"
"""Tells of a slice that it ends with the recording."""

DROPPED = "not over when its goal was retracted"
"""Tells of a plan-action that it ends with its goal."""

INDENT = "· "
"""Stands before the name of a track, once a level: there are no tracks below tracks, and blanks are cut."""

DEEPEST = 12
"""Levels that are indented."""

NOT_BEGUN = "FORMULATED"
OVER = frozenset({"FINAL", "FAILED"})


@dataclass(slots=True)
class GoalTracks:
    """Where things are.

    :param goals: the track of each goal, by its number.
    :param actions: the track of each plan-action, by its number; one that never began has none.
    """

    goals: dict[int, Track] = field(default_factory=dict)
    actions: dict[int, Track] = field(default_factory=dict)


def add_goals(model: RunModel, tracks: Tracks, events: Events, processes: dict[str, int]) -> GoalTracks:
    """Add a track for each goal, below its parent's, and below it those of its plans.

    :param processes: the process of each environment.
    """
    placed = GoalTracks()
    up = parents(model.goals)
    children: dict[int | None, list[int]] = {}
    for goal, parent in zip(model.goals, up, strict=True):
        children.setdefault(parent, []).append(goal.number)
    plans: dict[int | None, dict[str, list[Action]]] = {}
    for action in model.actions:
        plans.setdefault(action.goal, {}).setdefault(action.plan, []).append(action)
    stack = [(number, 0) for number in reversed(children.get(None, []))]
    while stack:
        number, depth = stack.pop()
        goal = model.goals[number]
        name = f"{_indent(depth)}{goal.goal} {goal.goal_class}"
        track = tracks.thread(processes[goal.env], name)
        placed.goals[number] = track
        _add_goal(goal, up[number], model, events, track)
        for plan, actions in plans.get(number, {}).items():
            _add_plan(model, tracks, events, placed, processes[goal.env], (plan, actions, depth + 1))
        stack += [(child, depth + 1) for child in reversed(children.get(number, []))]
    for plan, actions in plans.get(None, {}).items():
        _add_plan(model, tracks, events, placed, processes[actions[0].env], (plan, actions, 0))
    return placed


def _indent(depth: int) -> str:
    """Return what stands before the name of a track; deep ones stand below each other."""
    return INDENT * min(depth, DEEPEST)


def _add_goal(goal: Goal, parent: int | None, model: RunModel, events: Events, track: Track) -> None:
    """Add a slice for each life of a goal, and within it one for each mode."""
    end = model.events, model.end
    born: Moment | None = None
    for state, after in zip(goal.states, [*goal.states[1:], None], strict=True):
        here = state.seq, state.time
        born = born or here
        until = end if after is None else (after.seq, after.time)
        gone = state.mode == "RETRACTED"
        outcome = {} if state.outcome == "UNKNOWN" else {"outcome": state.outcome}
        error = {"error": state.error} if state.error else {}
        name = f"{state.mode} {state.outcome}" if outcome else state.mode
        if not gone:
            left = {} if after is not None else {"note": OPEN}
            events.slice(track, name, here, until, {**outcome, **error, **left}, category="mode", depth=1)
        if gone or after is None:
            facts = {
                "goal": goal.goal,
                "class": goal.goal_class,
                "sub-type": goal.sub_type,
                "parent": "" if parent is None else model.goals[parent].goal,
            }
            left = {} if gone else {"note": OPEN}
            events.slice(
                track,
                f"{goal.goal} {goal.goal_class}",
                born,
                here if gone else end,
                {**facts, **outcome, **error, **left},
                category="goal",
            )
            born = None


def _add_plan(
    model: RunModel,
    tracks: Tracks,
    events: Events,
    placed: GoalTracks,
    process: int,
    plan: tuple[str, list[Action], int],
) -> None:
    """Add a plan: a slice for it, within it its actions, within them their states.

    Actions that overlap each other get tracks of their own.
    """
    name, actions, depth = plan
    title = f"{_indent(depth)}plan {name}"
    lanes: list[tuple[Track, int]] = [(tracks.thread(process, title), -1)]
    spans = [(span, action) for action in actions if (span := _span(action, model)) is not None]
    spans.sort(key=lambda each: each[0][0])
    first = min(action.states[0][:2] for action in actions)
    ends = [span[1] for span, _ in spans]
    last = max([*ends, *(action.states[-1][:2] for action in actions)])
    idle = [f"{action.action_id} {action.name}" for action in actions if _span(action, model) is None]
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
        _add_action(action, events, track, (begin, end), DROPPED if end[0] < model.events else OPEN)


def _span(action: Action, model: RunModel) -> tuple[Moment, Moment] | None:
    """Return when an action began, which is when it was more than formulated, and when it was over."""
    begin = next(((seq, time) for seq, time, state in action.states if state != NOT_BEGUN), None)
    if begin is None:
        return None
    seq, time, state = action.states[-1]
    if state in OVER:
        return begin, (seq, time)
    return begin, _retraction(action, model) or (model.events, model.end)


def _retraction(action: Action, model: RunModel) -> Moment | None:
    """Return when an action's goal was retracted, after the action's last transition; None if it was not."""
    if action.goal is None:
        return None
    last = action.states[-1][0]
    states = model.goals[action.goal].states
    return next(
        ((each.seq, each.time) for each in states if each.seq > last and each.mode == "RETRACTED"), None
    )


def _add_action(
    action: Action, events: Events, track: Track, span: tuple[Moment, Moment], remark: str
) -> None:
    """Add a slice for an action, and within it one for each state.

    :param remark: what is said of it when it is not over.
    """
    begin, end = span
    last = action.states[-1][2]
    left = {} if last in OVER else {"note": remark}
    facts = {"action": action.name, "id": action.action_id, "goal": action.goal_id, "plan": action.plan}
    name = f"{action.action_id} {action.name}"
    events.slice(track, name, begin, end, {**facts, "state": last, **left}, category="action", depth=1)
    ends = [*(state[:2] for state in action.states[1:]), end]
    for (seq, time, state), until in zip(action.states, ends, strict=True):
        if seq >= begin[0] and seq < end[0]:
            events.slice(track, state, (seq, time), until, {}, category="state", depth=2)
