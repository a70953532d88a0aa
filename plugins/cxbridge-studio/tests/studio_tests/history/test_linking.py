"""`why` has the same skill for each action as the history of a run, with Skillers and with a skill board."""

from __future__ import annotations

from itertools import permutations

import pytest
from msgspec.structs import replace

from cxbridge.events import Event, FactChange, InterfaceWrite, PlannerCall
from cxbridge.trace.formats.base import Run
from cxbridge_studio.explain.goal_story import GoalStoryWriter
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history import test_board_linking as board
from tests.history.runs import ENV, ListRun, action, goal, us
from tests.history.test_linking import PLACES, ROBOTS, Pairs, a_run, expected, runs


def in_why(run: Run) -> Pairs:
    """Each goal's first action and its skill, as `why` sees it."""
    evidence = RecordedEvidence(run, None, None)
    assert evidence.history is not None
    goals = Goals(evidence.history)
    found = {}
    for name, each in ((one.id, one) for one in goals.all):
        run_of = goals.find_skill_link(each.actions[0])
        assert run_of is not None, name
        found[name] = run_of.call.skiller, run_of.call.skill_string
    return found


def skills_on_board(run, env=None):
    """Each goal's first action with the executor and the reason, as `why` sees it."""
    evidence = RecordedEvidence(run, None, env)
    assert evidence.history is not None
    goals = Goals(evidence.history)
    skills = {
        name: goals.find_skill_link(each.actions[0]) for name, each in ((goal.id, goal) for goal in goals.all)
    }
    return {
        name: None if skill is None else (skill.call.skiller, skill.call.error)
        for name, skill in skills.items()
    }


def with_plans(run: ListRun) -> ListRun:
    """Add the plans of a planner: `why` named other robots' skills without them."""
    plans: list[Event] = [
        PlannerCall(
            us(0), ENV, f"g{n}-PLAN", f"g{n}", "p", "d", "", "found", 1, 1, "", f"0: (move {PLACES[n]})"
        )
        for n in range(3)
    ]
    return ListRun([*plans, *run.events])


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_skillers(order):
    for ends in permutations((3.0, 5.0, 8.0)):
        assert in_why(a_run(order, ends, facts=False)) == expected()
    at_a_time = a_run(order, (3.0, 3.0, 3.0), facts=True)
    assert in_why(at_a_time) == expected()
    without_skiller = [
        replace(event, text=event.text.replace('(skiller "robot', '(skiller "of-robot'))
        if isinstance(event, FactChange)
        else event
        for event in at_a_time.events
    ]
    assert in_why(ListRun(without_skiller)) == expected()
    assert in_why(with_plans(a_run(order, (3.0, 3.0, 3.0), facts=False))) == expected()


def test_the_same_error_of_two_robots_and_twice_of_one_is_told_each_time():
    calls = list(expected().values())
    events: list[Event] = []
    for n, robot in enumerate((0, 1, 1)):
        begin, end = 1.0 + 3 * n, 2.0 + 3 * n
        events += [goal(begin, f"g{n}", "DISPATCHED"), action(begin, f"g{n}", 1, "move", "WAITING")]
        for at, status, error in ((begin, "S_RUNNING", ""), (end, "S_FAILED", "blocked")):
            values = {"error": error, "status": status}
            events.append(InterfaceWrite(us(at), f"SkillerInterface::{ROBOTS[robot]}", values))
            events.append(runs(at, *calls[robot], status, n))
            state = "RUNNING" if status == "S_RUNNING" else "EXECUTION-FAILED"
            events.append(action(at, f"g{n}", 1, "move", state))
    evidence = RecordedEvidence(ListRun(events), None, None)
    assert evidence.history is not None
    goals = Goals(evidence.history)
    skills = [goals.find_skill_link(one) for each in goals.all for one in each.actions]
    assert [skill and skill.call.error for skill in skills] == ["blocked"] * 3


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_skill_board(order):
    for over in permutations((3.0, 5.0, 8.0)):
        assert skills_on_board(board.a_run(order, over)) == board.EXPECTED
    assert skills_on_board(board.a_run(order, (3.0, 3.0, 3.0), facts=True)) == board.EXPECTED


def test_an_execution_that_is_not_over_has_no_reason():
    run = board.a_run((0, 1, 2), (3.0, 5.0, 8.0))
    cut = ListRun([event for event in run.events if event.time_us < us(3)])
    assert skills_on_board(cut) == {f"g{n}": (f"{board.ROBOTS[n]}-arm", "") for n in range(3)}


def test_why_names_the_reason():
    run = board.a_run((0, 1, 2), (3.0, 5.0, 8.0))
    evidence = RecordedEvidence(
        ListRun([*run.events, goal(9, "g0", "FINISHED", "FAILED", "ACTION-FAILED")]), None, ENV
    )
    assert evidence.history is not None
    goals = Goals(evidence.history)
    story = GoalStoryWriter(evidence, goals, {}).write_goal_story(goals.find_goals("g0")[0])
    texts = [cause.text for cause in story.cause.because[0].because]
    assert texts == ["probably skill move to=place0 of robot1 of robot1-arm ended S_FAILED: door closed"]
