"""Which skill an action ran, where several robots run skills at a time: `why` and the timeline agree."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import pytest
from msgspec.structs import replace

from cxbridge.clipstext.facts import parse_fact
from cxbridge.events import Event, FactChange, PlanActionTransition, SkillStatus
from cxbridge.history.builder import RunHistory
from cxbridge.history.linking import find_skill_links
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from tests.history.runs import ENV, ListRun, action, fact, goal, us

ROBOTS = ("robot1", "robot2", "robot3")
PLACES = ("hall", "hall-2", "office")
"""A place whose name is the begin of another's."""

Pairs = dict[str, tuple[str, str]]


def runs(at: float, skiller: str, text: str, status: str, msgid: int = 1) -> Event:
    """What a robot's Skiller says."""
    return SkillStatus(us(at), ENV, skiller, text, msgid, status)


def linked(run: Run) -> Pairs:
    return {
        link.action.goal: (link.call.skiller, link.call.skill_string)
        for link in find_skill_links(RunHistory.from_events(run))
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
        assert linked(run) == expected()


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_with_facts_skiller_and_arguments_pair_those_that_end_at_the_same_time(order):
    run = a_run(order, (3.0, 3.0, 3.0), facts=True)
    assert linked(run) == expected()


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
    paired = find_skill_links(RunHistory.from_events(whole))
    for link in paired:
        assert asked[link.action.goal, link.action.id] == link.call.skiller
    assert paired
    waited = {
        (event.goal, event.action_id)
        for event in whole
        if isinstance(event, PlanActionTransition) and event.state == "RUNNING"
    }
    assert len(waited) == len(paired)


def sent(at: float, of: str, state: str, call: str = "") -> PlanActionTransition:
    """A transition that says with which message robot1 got the action."""
    made = action(at, of, 1, "move", state)
    assert isinstance(made, PlanActionTransition)
    return replace(made, skiller="robot1" if call else "", call=call)


def test_a_number_that_a_refused_message_has_again_is_not_the_call_before():
    """After a restart of the Skiller numbers begin anew: the second message was refused, and nothing ran."""
    events: list[Event] = [
        goal(0, "g0", "DISPATCHED"),
        sent(0, "g0", "PENDING"),
        sent(0, "g0", "WAITING"),
        runs(1, "robot1", "move{}", "S_RUNNING", 7),
        sent(1, "g0", "RUNNING", "7"),
        runs(2, "robot1", "move{}", "S_FINAL", 7),
        sent(2, "g0", "FINAL", "7"),
        goal(3, "g1", "DISPATCHED"),
        sent(3, "g1", "PENDING"),
        sent(3, "g1", "WAITING"),
        sent(4, "g1", "FAILED", "7"),
    ]
    assert [
        (link.action.goal, link.is_guessed) for link in find_skill_links(RunHistory.from_events(events))
    ] == [("g0", False)]


def test_an_agent_that_does_not_say_it_is_guessed_beside_one_that_does():
    events: list[Event] = [
        event
        for own, call in (("new", "3"), ("old", ""))
        for event in (
            replace(goal(0, "g", "DISPATCHED"), env=own),
            replace(sent(0, "g", "WAITING"), env=own),
            replace(runs(1, f"{own}-robot", "move{}", "S_RUNNING", 3), env=own),
            replace(sent(1, "g", "RUNNING"), env=own, call=call, skiller="new-robot" if call else ""),
        )
    ]
    found = {
        link.action.env: (link.call.skiller, link.is_guessed)
        for link in find_skill_links(RunHistory.from_events(events))
    }
    assert found == {"new": ("new-robot", False), "old": ("old-robot", True)}


def test_of_two_actions_that_wait_the_action_with_the_name_of_the_skill_has_run_it():
    events = [
        goal(0, "g", "DISPATCHED"),
        *(action(1, "g", number, name, "WAITING") for number, name in ((1, "other"), (2, "move"))),
        runs(2, "Skiller", "move{}", "S_RUNNING"),
        *(action(2, "g", number, name, "RUNNING") for number, name in ((1, "other"), (2, "move"))),
    ]
    (link,) = find_skill_links(RunHistory.from_events(events))
    assert link.action.name == "move"


def test_a_skill_that_no_action_waits_for_has_no_action():
    events = [runs(at, "Skiller", "a", status) for at, status in ((1, "S_RUNNING"), (2, "S_FINAL"))]
    assert find_skill_links(RunHistory.from_events(events)) == []
