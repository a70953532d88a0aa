"""`why` explains both lives of a goal whose id is used twice."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

from cxbridge.events import Event, GoalTransition, PlannerCall
from cxbridge.history.model import find_goals
from cxbridge.run.program.finished import open_run
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history.runs import ENV, ListRun, action, fact, goal, us
from tests.history.test_lives import recorded

__all__ = ["recorded"]


@pytest.mark.parametrize("name", ["ROOM#2", "LOOK#2"])
def test_life_is_found_by_number(recorded: Path, name: str):
    answer = explain(RecordedEvidence(open_run(recorded).source, None, None), name, "goal")
    assert answer.json_report["goals"][0]["goal"] == "ROOM#2"
    assert answer.json_report["goals"][0]["outcome"] == "COMPLETED"


def test_life_is_found_by_time(recorded: Path):
    run = open_run(recorded)
    for life, name in enumerate(("ROOM", "ROOM#2")):
        end = find_goals(run.goals, "ROOM")[life].changes[-2].time / 1e6
        answer = explain(RecordedEvidence(run.source, end, None), "ROOM", "goal")
        assert [goal["goal"] for goal in answer.json_report["goals"]] == [name]


PLAN_ACTION = "(plan-action (id {number}) (goal-id g) (plan-id g-PLAN) (action-name move) {more})"


def make_two_lives() -> list[Event]:
    """Goal `g` fails twice, each time with a different sub-goal, action and planner."""
    events: list[Event] = []
    for life, nth in enumerate(("first", "second")):
        begin = 10.0 * life
        new = {"is_new": True}
        events += [
            structs.replace(goal(begin, "g", "FORMULATED"), **new),
            structs.replace(goal(begin, "sub", "FORMULATED", parent="g"), **new),
            action(begin, "g", 1, "move", "FORMULATED"),
            PlannerCall(
                us(begin), ENV, f"p{life}", "g", "p", "d", f"({nth})", "none", 1, 0, f"the {nth} reason"
            ),
            fact(begin + 1, 5 + life, PLAN_ACTION.format(number=1, more=f'(error-msg "the {nth} action")')),
            action(begin + 1, "g", 1, "move", "EXECUTION-FAILED"),
            action(begin + 1, "g", 1, "move", "FAILED"),
            fact(begin + 1, 5 + life, PLAN_ACTION.format(number=1, more='(error-msg "")'), asserted=False),
            goal(begin + 2, "sub", "FINISHED", "FAILED", f"{nth}-error", parent="g"),
            goal(begin + 3, "g", "FINISHED", "FAILED", "SUB-GOAL-FAILED sub" if life == 0 else ""),
        ]
    return events


def explain_goal(name: str, events: list[Event]) -> str:
    answer = explain(RecordedEvidence(ListRun(events), None, None), name, "goal")
    return "\n".join(answer.lines)


def test_each_life_has_separate_causes():
    first, second = explain_goal("g#1", make_two_lives()), explain_goal("g#2", make_two_lives())
    assert "sub (SUB) FAILED at 2.000 s, error: first-error" in first
    assert "second" not in first
    assert "action 1 move failed at 11.000 s" in second
    assert "the second action" in second
    assert "first" not in second


def test_each_life_has_separate_planner_call():
    events: list[Event] = [
        event
        for event in make_two_lives()
        if isinstance(event, PlannerCall) or (isinstance(event, GoalTransition) and event.goal == "g")
    ]
    assert "no plan for (first): the first reason" in explain_goal("g#1", events)
    assert "no plan for (second): the second reason" in explain_goal("g#2", events)


def test_goal_without_fact_does_not_wait():
    """The second use of the id shows that the fact was retracted before the end of the goal."""
    events = [
        event
        for event in make_two_lives()
        if not isinstance(event, GoalTransition) or event.mode != "FINISHED"
    ]
    story = explain_goal("g#1", events)
    assert "g (G) was FORMULATED when its fact was retracted" in story
    assert "waits" not in story
    assert "waits" in explain_goal("g#2", events)


@pytest.mark.parametrize("recorded_facts", [True, False])
def test_goal_with_retracted_fact_does_not_wait(recorded_facts: bool):
    events: list[Event] = [goal(0, "g", "FORMULATED"), goal(1, "g", "SELECTED")]
    if recorded_facts:
        text = "(goal (id g) (class G) (mode SELECTED))"
        events += [fact(1, 7, text), fact(2, 7, text, asserted=False)]
    story = explain_goal("g", events)
    assert ("g (G) was SELECTED when its fact was retracted" in story) is recorded_facts
    assert ("waits" in story) is not recorded_facts
