"""Which skill an action ran, where several robots run skills at a time: `why` and the timeline agree."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import pytest
from msgspec.structs import replace

from cxbridge.clipstext.facts import parse_fact
from cxbridge.events import Event, FactChange, InterfaceWrite, PlanActionTransition, PlannerCall, SkillStatus
from cxbridge.history.builder import RunHistory
from cxbridge.history.linking import links
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.recorded import RecordedEvidence
from studio_tests.explain.runs import ENV, ListRun, action, fact, goal, us

ROBOTS = ("robot1", "robot2", "robot3")
PLACES = ("hall", "hall-2", "office")
"""A place whose name is the begin of another's."""

Pairs = dict[str, tuple[str, str]]


def runs(at: float, skiller: str, text: str, status: str, msgid: int = 1) -> Event:
    """What a robot's Skiller says."""
    return SkillStatus(us(at), ENV, skiller, text, msgid, status)


def in_why(run: Run) -> Pairs:
    """Each goal's first action and its skill, as `why` sees it."""
    evidence = RecordedEvidence(run, None, None)
    assert evidence.history is not None
    goals = Goals(evidence.history, {})
    found = {}
    for name, each in ((one.id, one) for one in goals.all):
        run_of = goals.skill(each.actions[0])
        assert run_of is not None, name
        found[name] = run_of.call.skiller, run_of.call.skill_string
    return found


def in_timeline(run: Run) -> Pairs:
    return {
        link.action.goal: (link.call.skiller, link.call.skill_string) for link in links(RunHistory.of(run))
    }


def expected() -> Pairs:
    return {
        f"g{n}": (robot, f'move{{to="{place}"}}')
        for n, (robot, place) in enumerate(zip(ROBOTS, PLACES, strict=True))
    }


def a_run(order: tuple[int, ...], ends: tuple[float, ...], *, facts: bool) -> ListRun:
    """Three robots that move at a time: they begin in ``order``, and end at times of their own.

    The actions come to run in the order of their goals.
    """
    events: list[Event] = []
    for n in range(3):
        events.append(goal(0, f"g{n}", "DISPATCHED"))
        events.append(action(0, f"g{n}", 1, "move", "FORMULATED"))
        if facts:
            slots = f'(param-names to) (param-values {PLACES[n]}) (skiller "{ROBOTS[n]}")'
            text = f"(plan-action (id 1) (goal-id g{n}) (plan-id g{n}-PLAN) (action-name move) {slots})"
            events.append(fact(0, 100 + n, text))
        events.append(action(0.5, f"g{n}", 1, "move", "WAITING"))
    calls = list(expected().values())
    events += [runs(1, *calls[n], "S_RUNNING") for n in order]
    events += [action(1, f"g{n}", 1, "move", "RUNNING") for n in range(3)]
    for n in sorted(range(3), key=lambda n: ends[n]):
        events.append(runs(ends[n], *calls[n], "S_FINAL"))
        events.append(action(ends[n], f"g{n}", 1, "move", "EXECUTION-SUCCEEDED"))
    return ListRun(events)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_recording_without_facts_pairs_those_that_end_together(order):
    for ends in permutations((3.0, 5.0, 8.0)):
        run = a_run(order, ends, facts=False)
        assert in_timeline(run) == in_why(run) == expected()


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_with_facts_skiller_and_arguments_pair_those_that_end_at_the_same_time(order):
    run = a_run(order, (3.0, 3.0, 3.0), facts=True)
    assert in_timeline(run) == in_why(run) == expected()


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_arguments_alone_pair_them_where_the_slot_skiller_names_none(order):
    run = a_run(order, (3.0, 3.0, 3.0), facts=True)
    events = [
        replace(event, text=event.text.replace('(skiller "robot', '(skiller "of-robot'))
        if isinstance(event, FactChange)
        else event
        for event in run.events
    ]
    assert in_timeline(ListRun(events)) == in_why(ListRun(events)) == expected()


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_plans_of_a_planner_pair_them_without_facts(order):
    """`why` did not look at plans: it named other robots' skills where the timeline was right."""
    run = a_run(order, (3.0, 3.0, 3.0), facts=False)
    plans: list[Event] = [
        PlannerCall(
            us(0), ENV, f"g{n}-PLAN", f"g{n}", "p", "d", "", "found", 1, 1, "", f"0: (move {PLACES[n]})"
        )
        for n in range(3)
    ]
    planned = ListRun([*plans, *run.events])
    assert in_timeline(planned) == in_why(planned) == expected()


def test_each_action_of_two_robots_has_the_skill_of_its_own_robot(tmp_path: Path):
    recorded = tmp_path / "two.mcap"
    run_scenario(
        RunOptions(scenario=shipped_dir("scenarios") / "two-robots", trace=recorded, trace_level="facts")
    )
    whole = open_run(recorded)
    asked: dict[tuple[str, str], str] = {}
    for event in whole:
        if isinstance(event, FactChange) and event.asserted and event.template == "plan-action":
            slots = parse_fact(event.text)[1]
            asked[slots["goal-id"], slots["id"]] = slots["skiller"].strip('"')
    told = [event for event in whole if isinstance(event, SkillStatus)]
    assert len({event.skiller for event in told}) == 2
    paired = links(RunHistory.of(whole))
    for link in paired:
        assert asked[link.action.goal, link.action.id] == link.call.skiller
    evidence = RecordedEvidence(whole, None, None)
    assert evidence.history is not None
    goals = Goals(evidence.history, {})
    ran = 0
    for name, each in ((one.id, one) for one in goals.all):
        for one in each.actions:
            if (skill := goals.skill(one)) is not None:
                ran += 1
                assert asked[name, one.id] == skill.call.skiller, (name, one)
    assert ran
    waited = {
        (event.goal, event.action_id)
        for event in whole
        if isinstance(event, PlanActionTransition) and event.state == "RUNNING"
    }
    assert len(waited) == ran


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
    goals = Goals(evidence.history, {})
    skills = [goals.skill(one) for each in goals.all for one in each.actions]
    assert [skill and skill.call.error for skill in skills] == ["blocked"] * 3
