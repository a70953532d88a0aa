"""Trees of goals: whatever the slots say, each goal is shown once, in every view."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest

from cxbridge.events import GoalTransition
from cxbridge.history.builder import RunHistory
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.model import goal_forest, goal_tree
from cxbridge.run.result import COMPLETED, RunResult
from cxbridge.trace.compare.context import goal_lines
from cxbridge.trace.compare.goals import GoalForest, walk_goals
from tests.history.runs import goal
from tests.support import many
from tests.trace.runs import MemoryRun

SHAPES = {
    "no id": {"nil": "nil"},
    "no id beside others": {"nil": "nil", "a": "nil", "b": "a"},
    "below itself": {"a": "a", "b": "a"},
    "each other's parents": {"a": "b", "b": "a", "c": "b"},
    "a ring of three": {"c": "d", "a": "b", "b": "c", "d": "b", "e": "nil"},
    "two rings": {"a": "b", "b": "a", "c": "d", "d": "c"},
    "a parent that never was": {"a": "gone", "b": "a"},
    "a thousand deep": {f"g{n}": f"g{n - 1}" if n else "nil" for n in range(1500)},
}


@pytest.mark.parametrize("count", range(1, many(6, 5)))
def test_every_way_to_have_parents_is_a_forest(count: int) -> None:
    goals = range(count)
    for chosen in product([None, *goals, "elsewhere"], repeat=count):
        given = dict(zip(goals, chosen, strict=True))
        forest = Forest(given)
        walked = [each for each, _ in forest.walk()]
        assert sorted(walked) == list(goals)
        depths = dict(forest.walk())
        for each, parent in forest.parents.items():
            assert depths[each] == (0 if parent is None else depths[parent] + 1)
        cut = [each for each in goals if given[each] in given and forest.parents[each] is None]
        assert len(cut) == rings(given)
        assert all(each == min(ring_of(each, given)) for each in cut)


def ring_of(start: int, parents: dict[int, object]) -> list[int]:
    """The goals on the ring that a goal is on; none when it is on none."""
    ring: list[int] = [start]
    while (above := parents.get(ring[-1])) in parents:
        assert isinstance(above, int)
        if above == start:
            return ring
        if above in ring:
            return []
        ring.append(above)
    return []


def rings(parents: dict[int, object]) -> int:
    """How many rings there are."""
    return len({frozenset(ring) for each in parents if (ring := ring_of(each, parents))})


def selected(name: str, parent: str) -> GoalTransition:
    return GoalTransition(0, "executive", name, "C", "nil", parent, "SELECTED", "", "")


def of_result(shape: dict[str, str]) -> list[str]:
    goals = tuple(selected(each, above) for each, above in shape.items())
    result = RunResult(COMPLETED, "", "", goals, 0, 0, 0.0, 0.0)
    return [line.split("─ ")[-1].split(" (")[0] for line in result.goal_lines()]


def of_test(shape: dict[str, str]) -> list[str]:
    return [
        line.split("─ ")[-1].split()[0] for line in goal_tree(RunHistory.from_events(events(shape)).goals)
    ]


def of_comparison(shape: dict[str, str]) -> list[str]:
    return [each.key[1] for each in walk_goals(GoalForest(MemoryRun(events(shape))).roots)]


def of_trail(shape: dict[str, str]) -> list[str]:
    return [line.goal for line in goal_lines({event.goal: event for event in events(shape)})]


def of_report(shape: dict[str, str]) -> list[str]:
    goals = RunHistory.from_events(events(shape)).goals
    return [goals[number].id for number, _ in goal_forest(goals).walk()]


def events(shape: dict[str, str]) -> list[Any]:
    """The goals, as transitions."""
    made = [goal(0.0, each, "FORMULATED", parent=above) for each, above in shape.items()]
    made += [goal(1.0, each, "SELECTED", parent=above) for each, above in shape.items()]
    return made


VIEWS = (of_result, of_test, of_comparison, of_trail, of_report)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.__name__)
def test_each_goal_is_shown_once_whatever_is_its_parent(view, shape: str) -> None:
    assert sorted(view(SHAPES[shape])) == sorted(SHAPES[shape])


def test_a_goal_without_id_is_above_nobody() -> None:
    assert parent_id("nil") is parent_id("") is None
    goals = selected("nil", "nil"), selected("a", "nil")
    result = RunResult(0, "", "", goals, 0, 0, 0.0, 0.0)
    assert result.goal_lines() == [
        "nil (C): SELECTED",
        "a (C): SELECTED",
    ]
