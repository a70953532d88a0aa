"""Trees of goals: each view shows each goal once, with any parents."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest

from cxbridge.event_kinds import View
from cxbridge.events import GoalTransition
from cxbridge.history.builder import RunHistory
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.model import goal_forest, goal_tree
from cxbridge.history.tree import latest_lines
from cxbridge.run.result import COMPLETED, RunResult
from cxbridge.trace.compare.context import goals_at_difference
from cxbridge.trace.compare.goals import GoalForest, walk_goals
from cxbridge.trace.compare.steps import StepReader
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
def test_any_parents_make_forest(count: int) -> None:
    goals = range(count)
    for chosen in product([None, *goals, "elsewhere"], repeat=count):
        given_parents = dict(zip(goals, chosen, strict=True))
        forest = Forest(given_parents)
        walked = [node for node, _ in forest.walk()]
        assert sorted(walked) == list(goals)
        depths = dict(forest.walk())
        for node, parent in forest.parents.items():
            assert depths[node] == (0 if parent is None else depths[parent] + 1)
        cut = [
            node for node in goals if given_parents[node] in given_parents and forest.parents[node] is None
        ]
        assert len(cut) == count_rings(given_parents)
        assert all(node == min(ring_of(node, given_parents)) for node in cut)


def ring_of(start: int, parents: dict[int, object]) -> list[int]:
    """Return the goals of the ring with a goal, empty without a ring."""
    ring: list[int] = [start]
    while (above := parents.get(ring[-1])) in parents:
        assert isinstance(above, int)
        if above == start:
            return ring
        if above in ring:
            return []
        ring.append(above)
    return []


def count_rings(parents: dict[int, object]) -> int:
    """Return the number of rings."""
    return len({frozenset(ring) for node in parents if (ring := ring_of(node, parents))})


def selected(name: str, parent: str) -> GoalTransition:
    return GoalTransition(0, "executive", name, "C", "nil", parent, "SELECTED", "", "")


def result_goals(shape: dict[str, str]) -> list[str]:
    goals = tuple(selected(name, parent) for name, parent in shape.items())
    result = RunResult(COMPLETED, "", "", goals, 0, 0, 0.0, 0.0)
    return [line.split("─ ")[-1].split(" (")[0] for line in result.goal_lines()]


def tree_goals(shape: dict[str, str]) -> list[str]:
    return [
        line.split("─ ")[-1].split()[0] for line in goal_tree(RunHistory.from_events(events(shape)).goals)
    ]


def comparison_goals(shape: dict[str, str]) -> list[str]:
    return [
        node.key[1]
        for node in walk_goals(
            GoalForest(StepReader().read(MemoryRun(events(shape)), View.TRANSITIONS)).roots
        )
    ]


def trail_goals(shape: dict[str, str]) -> list[str]:
    return [line.goal for line in goals_at_difference({event.goal: event for event in events(shape)})]


def report_goals(shape: dict[str, str]) -> list[str]:
    goals = RunHistory.from_events(events(shape)).goals
    return [goals[number].id for number, _ in goal_forest(goals).walk()]


def events(shape: dict[str, str]) -> list[Any]:
    """Return transitions of the goals."""
    transitions = [goal(0.0, name, "FORMULATED", parent=parent) for name, parent in shape.items()]
    transitions += [goal(1.0, name, "SELECTED", parent=parent) for name, parent in shape.items()]
    return transitions


VIEWS = (result_goals, tree_goals, comparison_goals, trail_goals, report_goals)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.__name__)
def test_view_shows_each_goal_once(view, shape: str) -> None:
    assert sorted(view(SHAPES[shape])) == sorted(SHAPES[shape])


def test_goal_without_id_is_no_parent() -> None:
    assert parent_id("nil") is parent_id("") is None
    goals = selected("nil", "nil"), selected("a", "nil")
    assert RunResult(0, "", "", goals, 0, 0, 0.0, 0.0).goal_lines() == [
        "nil (C): SELECTED",
        "a (C): SELECTED",
    ]


def test_number_of_printed_lines_is_bounded() -> None:
    assert [*latest_lines(range(203))] == ["(3 earlier lines of goals are not printed)", *range(3, 203)]
