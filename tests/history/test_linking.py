"""The links between actions and skill calls of several robots; `why` and the timeline use the same links."""

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
"""A place whose name begins another place's name."""

Pairs = dict[str, tuple[str, str]]


def skill_status(at: float, skiller: str, text: str, status: str, msgid: int = 1) -> Event:
    """Return a status of a robot's Skiller."""
    return SkillStatus(us(at), ENV, skiller, text, msgid, status)


def links_by_goal(run: Run) -> Pairs:
    return {
        link.action.goal: (link.call.skiller, link.call.skill_string)
        for link in find_skill_links(RunHistory.from_events(run))
    }


def expected() -> Pairs:
    return {
        f"g{n}": (robot, f'move{{to="{place}"}}')
        for n, (robot, place) in enumerate(zip(ROBOTS, PLACES, strict=True))
    }


def run_of_robots(order: tuple[int, ...], ends: tuple[float, ...], *, facts: bool) -> ListRun:
    """Return a run of three robots that move at the same time: they begin in ``order``, and end at ``ends``.

    The actions become RUNNING in the order of their goals.
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
    events += [skill_status(1, *calls[n], "S_RUNNING") for n in order]
    events += [action(1, f"g{n}", 1, "move", "RUNNING") for n in range(3)]
    for n in sorted(range(3), key=lambda n: ends[n]):
        events.append(skill_status(ends[n], *calls[n], "S_FINAL"))
        events.append(action(ends[n], f"g{n}", 1, "move", "EXECUTION-SUCCEEDED"))
    return ListRun(events)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_equal_ends_link_actions_without_facts(order):
    for ends in permutations((3.0, 5.0, 8.0)):
        run = run_of_robots(order, ends, facts=False)
        assert links_by_goal(run) == expected()


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_skiller_and_arguments_in_facts_link_calls_with_same_end(order):
    run = run_of_robots(order, (3.0, 3.0, 3.0), facts=True)
    assert links_by_goal(run) == expected()


def test_each_action_of_two_robots_has_call_of_its_robot(tmp_path: Path):
    recorded = tmp_path / "two.mcap"
    run_scenario(
        RunOptions(scenario=shipped_dir("scenarios") / "two-robots", trace=recorded, trace_level="facts")
    )
    run = open_run(recorded)
    expected_skillers: dict[tuple[str, str], str] = {}
    for event in run:
        if isinstance(event, FactChange) and event.asserted and event.template == "plan-action":
            slots = parse_fact(event.text)[1]
            expected_skillers[slots["goal-id"], slots["id"]] = slots["skiller"].strip('"')
    statuses = [event for event in run if isinstance(event, SkillStatus)]
    assert len({event.skiller for event in statuses}) == 2
    links = find_skill_links(RunHistory.from_events(run))
    for link in links:
        assert expected_skillers[link.action.goal, link.action.id] == link.call.skiller
    assert links
    running = {
        (event.goal, event.action_id)
        for event in run
        if isinstance(event, PlanActionTransition) and event.state == "RUNNING"
    }
    assert len(running) == len(links)


def sent_action(at: float, of: str, state: str, call: str = "") -> PlanActionTransition:
    """Return a transition with the id of the message that sent the action to robot1."""
    transition = action(at, of, 1, "move", state)
    assert isinstance(transition, PlanActionTransition)
    return replace(transition, skiller="robot1" if call else "", call=call)


def test_refused_message_with_reused_id_has_no_call():
    """Ids restart with the Skiller: the second message was refused, and no skill ran."""
    events: list[Event] = [
        goal(0, "g0", "DISPATCHED"),
        sent_action(0, "g0", "PENDING"),
        sent_action(0, "g0", "WAITING"),
        skill_status(1, "robot1", "move{}", "S_RUNNING", 7),
        sent_action(1, "g0", "RUNNING", "7"),
        skill_status(2, "robot1", "move{}", "S_FINAL", 7),
        sent_action(2, "g0", "FINAL", "7"),
        goal(3, "g1", "DISPATCHED"),
        sent_action(3, "g1", "PENDING"),
        sent_action(3, "g1", "WAITING"),
        sent_action(4, "g1", "FAILED", "7"),
    ]
    assert [
        (link.action.goal, link.is_guessed) for link in find_skill_links(RunHistory.from_events(events))
    ] == [("g0", False)]


def test_agent_without_call_ids_is_linked_by_guess():
    events: list[Event] = [
        event
        for env, call in (("new", "3"), ("old", ""))
        for event in (
            replace(goal(0, "g", "DISPATCHED"), env=env),
            replace(sent_action(0, "g", "WAITING"), env=env),
            replace(skill_status(1, f"{env}-robot", "move{}", "S_RUNNING", 3), env=env),
            replace(sent_action(1, "g", "RUNNING"), env=env, call=call, skiller="new-robot" if call else ""),
        )
    ]
    links = {
        link.action.env: (link.call.skiller, link.is_guessed)
        for link in find_skill_links(RunHistory.from_events(events))
    }
    assert links == {"new": ("new-robot", False), "old": ("old-robot", True)}


def test_waiting_action_with_name_of_skill_is_linked():
    events = [
        goal(0, "g", "DISPATCHED"),
        *(action(1, "g", number, name, "WAITING") for number, name in ((1, "other"), (2, "move"))),
        skill_status(2, "Skiller", "move{}", "S_RUNNING"),
        *(action(2, "g", number, name, "RUNNING") for number, name in ((1, "other"), (2, "move"))),
    ]
    (link,) = find_skill_links(RunHistory.from_events(events))
    assert link.action.name == "move"


def test_skill_without_waiting_action_has_no_link():
    events = [skill_status(at, "Skiller", "a", status) for at, status in ((1, "S_RUNNING"), (2, "S_FINAL"))]
    assert find_skill_links(RunHistory.from_events(events)) == []
