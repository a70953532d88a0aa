"""The links between actions and executions of a skill board; `why` and the timeline use the same links."""

from __future__ import annotations

import json
from itertools import permutations

import pytest
from msgspec.structs import replace

from cxbridge.events import Event, GoalTransition, InterfaceMessage, PlanActionTransition
from cxbridge.history.builder import RunHistory
from cxbridge.history.linking import find_skill_links
from tests.history.runs import ListRun, action, fact, goal, us

ROBOTS = ("robot1", "robot2", "robot3")
REASONS = ("door closed", "battery low", "")
"""The reason of each robot's failure; an empty reason means success."""


def sent(at: float, master: int, kind: str, to_board: bool, env: str = "", **values: object) -> Event:
    """Return a message between a master and its executor, on the blackboard of ``env`` if given."""
    plain_uid = (
        "SkillBoardInterface::SkillBoard" if to_board else f"SkillExecutorInterface::{ROBOTS[master]}-arm"
    )
    uid = plain_uid.replace("::", f"::{env}/") if env else plain_uid
    ticket = {"board": "SkillBoard", "epoch": 5, "master": master}
    if to_board:
        ticket["executor"] = f"{ROBOTS[master]}-arm"
    return InterfaceMessage(us(at), uid, f"{kind}Message", 1, "", "queued", {**ticket, **values})


def begins(at: float, n: int, env: str = "", place: str = "hall") -> list[Event]:
    parameters = json.dumps({"to": place})
    return [
        sent(at, n, "Request", False, env, agent=ROBOTS[n], skill="move", parameters=parameters, name=""),
        sent(at, n, "Response", True, env),
        sent(at, n, "Confirm", False, env),
        sent(at, n, "Feedback", True, env, progress=0.1, text="on its way"),
    ]


def ends(at: float, n: int, reason: str, env: str = "") -> Event:
    outcome = "FAILED" if reason else "SUCCEEDED"
    return sent(at, n, "Finish", True, env, outcome=outcome, error=reason)


def run_of_robots(order: tuple[int, ...], over: tuple[float, ...], *, facts: bool = False) -> ListRun:
    """Return a run of three parallel robots: they begin in ``order`` and end at ``over``."""
    events: list[Event] = []
    for n in range(3):
        events += [goal(0, f"g{n}", "DISPATCHED"), action(0, f"g{n}", 1, "move", "FORMULATED")]
        if facts:
            slots = f"(param-names r to) (param-values {ROBOTS[n]} place{n})"
            text = f"(plan-action (id 1) (goal-id g{n}) (plan-id g{n}-PLAN) (action-name move) {slots})"
            events.append(fact(0, 100 + n, text))
        events.append(action(0.5, f"g{n}", 1, "move", "WAITING"))
    for n in order:
        events += begins(1, n, place=f"place{n}")
    events += [action(1, f"g{n}", 1, "move", "RUNNING") for n in range(3)]
    for n in sorted(range(3), key=lambda n: over[n]):
        state = "EXECUTION-FAILED" if REASONS[n] else "EXECUTION-SUCCEEDED"
        events += [ends(over[n], n, REASONS[n]), action(over[n], f"g{n}", 1, "move", state)]
    return ListRun(events)


def links_by_goal(run):
    return {
        link.action.goal: (link.call.skiller, link.call.error)
        for link in find_skill_links(RunHistory.from_events(run))
    }


EXPECTED = {f"g{n}": (f"{ROBOTS[n]}-arm", REASONS[n]) for n in range(3)}


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_actions_of_parallel_robots_have_their_executions(order):
    for over in permutations((3.0, 5.0, 8.0)):
        run = run_of_robots(order, over)
        assert links_by_goal(run) == EXPECTED


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_arguments_in_facts_link_executions_with_same_end(order):
    run = run_of_robots(order, (3.0, 3.0, 3.0), facts=True)
    assert links_by_goal(run) == EXPECTED


def test_repeated_action_has_reason_of_each_failure():
    def attempt(at, number, reason):
        return [
            action(at, "g0", number, "move", "FORMULATED"),
            action(at, "g0", number, "move", "WAITING"),
            *begins(at + 0.1, 0),
            action(at + 0.2, "g0", number, "move", "RUNNING"),
            ends(at + 1, 0, reason),
            action(at + 1, "g0", number, "move", "EXECUTION-FAILED"),
        ]

    run = ListRun([goal(0, "g0", "DISPATCHED"), *attempt(0, 1, "door closed"), *attempt(5, 2, "battery low")])
    links = find_skill_links(RunHistory.from_events(run))
    assert [(link.action.id, link.call.error) for link in links] == [
        ("1", "door closed"),
        ("2", "battery low"),
    ]


def in_env(env: str, event: Event) -> Event:
    """Return the event in another environment."""
    assert isinstance(event, GoalTransition | PlanActionTransition)
    return replace(event, env=env)


@pytest.mark.parametrize(("first", "second"), list(permutations(("robot1", "robot2"))))
def test_agents_of_same_run_have_separate_boards(first, second):
    """Each agent has its own blackboard, so executors may have equal names."""
    events: list[Event] = []
    for env in (first, second):
        events.append(in_env(env, goal(0, f"of-{env}", "DISPATCHED")))
        events += [
            in_env(env, action(0, f"of-{env}", 1, "move", state)) for state in ("FORMULATED", "WAITING")
        ]
        events += begins(1, 0, env)
        events.append(in_env(env, action(1, f"of-{env}", 1, "move", "RUNNING")))
    for env, reason in ((first, "door closed"), (second, "battery low")):
        failed = action(3, f"of-{env}", 1, "move", "EXECUTION-FAILED")
        events += [ends(3, 0, reason, env), in_env(env, failed)]
    run = ListRun(events)
    expected = {
        f"of-{first}": ("robot1-arm", "door closed"),
        f"of-{second}": ("robot1-arm", "battery low"),
    }
    assert links_by_goal(run) == expected
