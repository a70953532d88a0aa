"""Trees of goals in the built-in core: making them, their clean-up."""

from __future__ import annotations

import pytest

from tests.executive.core.core_bench import Bench
from tests.executive.core.goal_bench import grow, make_bench


def test_ids_and_priorities_of_tree(bench: Bench) -> None:
    bench.env.eval(
        "(goal-tree-assert-run-all AUTOMATIC-SUBGOAL (assert (goal (class A)))"
        " (goal-tree-assert-retry B 3 (assert (goal (id mine) (class C)))))"
    )
    root = bench.one("goal", sub_type="RUN-ALL-OF-SUBGOALS")
    first, retry, leaf = (
        bench.one("goal", **{"class": "A"}),
        bench.one("goal", **{"class": "B"}),
        bench.goal("mine"),
    )
    assert str(root["id"]).startswith("RUN-ALL-AUTOMATIC-SUBGOAL-gen")
    assert str(first["id"]).startswith("A-gen")
    assert str(retry["id"]).startswith("RETRY-B-gen")
    assert (first["priority"], retry["priority"], leaf["priority"]) == (2, 1, 0)
    assert (first["parent"], retry["parent"], leaf["parent"]) == (root["id"], root["id"], retry["id"])
    assert retry["params"] == ("max-tries", 3)


def test_goal_without_id_gets_id(bench: Bench) -> None:
    """A goal with id nil would be the parent of every root: its retraction would retract all roots."""
    bench.retract_automatically()
    bench.env.eval(
        "(assert (goal (class A) (mode RETRACTED)) (goal (id other)) (goal (class B) (parent other)))"
        # the first goal keeps its id, which rules may hold
    )
    bench.tick()
    goals = {str(goal["id"]): str(goal["parent"]) for goal in bench.all("goal")}
    assert set(goals.values()) == {"nil", "other"}
    assert "nil" not in goals
    assert next(child for child, parent in goals.items() if parent == "other").startswith("B-gen")
    assert len(goals) == 2


def test_retracted_root_retracts_whole_tree(bench: Bench) -> None:
    bench.retract_automatically()
    parent = grow(bench, "run-all", "COMPLETED", "COMPLETED")
    bench.env.eval(
        "(assert (goal (id other)) (plan (id X) (goal-id other))"
        " (plan-action (id 1) (plan-id X) (goal-id other))"
        " (plan (id X) (goal-id C1)) (plan-action (id 1) (plan-id X) (goal-id C1))"
        " (plan-action (id 2) (plan-id NO-PLAN) (goal-id C2)))"
    )
    bench.tick()
    assert {str(goal["id"]) for goal in bench.all("goal")} == {parent, "C1", "C2", "other"}
    bench.modify("goal", "(mode RETRACTED)", id=parent)
    bench.tick()
    assert [goal["id"] for goal in bench.all("goal")] == ["other"]
    assert [plan["goal-id"] for plan in bench.all("plan")] == ["other"]
    assert [action["goal-id"] for action in bench.all("plan-action")] == ["other"]
    assert f"Retracting goal {parent}" in bench.texts("I")
    assert not bench.all("goal-tree-retract")
    assert not bench.all("goal-plan-retract")


def test_root_with_resources_stays(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.eval("(assert (goal (id R) (mode RETRACTED) (acquired-resources r1)))")
    bench.tick()
    assert bench.state("R")[0] == "RETRACTED"
    bench.modify("goal", "(acquired-resources)", id="R")
    bench.tick()
    assert not bench.all("goal")


def test_children_of_maintain_goals_are_retracted_separately(bench: Bench) -> None:
    bench.retract_automatically()
    bench.env.eval(
        "(assert (goal (id M) (type MAINTAIN)) (goal (id C1) (parent M) (mode RETRACTED))"
        " (goal (id C2) (parent M)) (goal (id A)) (goal (id C3) (parent A) (mode RETRACTED)))"
    )
    bench.tick()
    assert [str(goal["id"]) for goal in bench.all("goal")] == ["M", "C2", "A", "C3"]


def test_firings_of_transition_are_independent_of_number_of_goals() -> None:
    """The work for one goal does not grow with the number of goals."""

    def firings(others: int) -> int:
        bench = make_bench()
        for number in range(others):
            bench.env.eval(f"(assert (goal (id other-{number})))")
        bench.tick()
        grow(bench, "run-all", "COMPLETED", "COMPLETED")
        return bench.tick()

    assert firings(0) == firings(50)


RINGS = {
    "of two": "(goal (id A) (type MAINTAIN) (parent B)) (goal (id B) (parent A) (mode RETRACTED))",
    "of two, retracted": "(goal (id A) (type MAINTAIN) (parent B) (mode RETRACTED))"
    " (goal (id B) (parent A) (mode RETRACTED))",
    "of three": "(goal (id A) (type MAINTAIN) (parent C)) (goal (id B) (parent A) (mode RETRACTED))"
    " (goal (id C) (parent B))",
    "of one": "(goal (id A) (type MAINTAIN) (parent A) (mode RETRACTED))",
    "with a tree below": "(goal (id A) (type MAINTAIN) (parent B)) (goal (id B) (parent A) (mode RETRACTED))"
    " (goal (id L1) (parent A)) (goal (id L2) (parent L1) (mode DISPATCHED))",
}


@pytest.mark.parametrize("ring", RINGS.values(), ids=RINGS)
def test_ring_of_goals_is_retracted_like_tree(bench: Bench, ring: str) -> None:
    """Each goal of the ring is below itself, and waits for the goals below it."""
    bench.retract_automatically()
    plans = "(plan (id P) (goal-id A)) (plan-action (id 1) (plan-id P) (goal-id A))"
    orphan = "(plan-action (id 2) (plan-id GONE) (goal-id B))" if "(id B)" in ring else ""
    bench.env.eval(f"(assert (goal (id other)) {ring} {plans} {orphan})")
    bench.tick()
    assert [goal["id"] for goal in bench.all("goal")] == ["other"]
    left = ("plan", "plan-action", "goal-tree-retract", "goal-plan-retract")
    assert not any(bench.all(template) for template in left)
