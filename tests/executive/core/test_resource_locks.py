"""Locks for the resources of goals in the built-in core: all or none.

The table is that of the compatibility page on the behaviour of the CX core, section 8.1.
"""

from __future__ import annotations

import pytest

from tests.executive.core.test_coordination import CoordinationBench


@pytest.fixture
def bench() -> CoordinationBench:
    return CoordinationBench()


def _goal(bench: CoordinationBench, goal_id: str, resources: str, acquired: str = "") -> None:
    bench.env.assert_string(
        f"(goal (id {goal_id}) (class C) (mode COMMITTED) (required-resources {resources})"
        f" (acquired-resources {acquired}))"
    )
    bench.env.run()


def _acquired(bench: CoordinationBench, goal_id: str) -> set[str]:
    acquired = bench.goal(goal_id)["acquired-resources"]
    assert isinstance(acquired, tuple)
    return set(map(str, acquired))


def test_a_goal_gets_all_its_resources_and_gives_them_back(bench: CoordinationBench) -> None:
    _goal(bench, "G", "cup plate")
    assert sorted(bench.texts("W")) == ["Locking resource cup", "Locking resource plate"]
    assert len(bench.all("resource-request")) == 2
    bench.settle()
    assert _acquired(bench, "G") == {"cup", "plate"}
    assert bench.state("G") == ("COMMITTED", "UNKNOWN")
    assert bench.answer("resource-cup") == ("NONE", "NONE", "LOCKED", "me")
    bench.modify("goal", "(mode FINISHED) (outcome COMPLETED)", id="G")
    bench.settle()
    assert len(_acquired(bench, "G")) == 2
    bench.modify("goal", "(mode RETRACTED)", id="G")
    bench.settle()
    assert _acquired(bench, "G") == set()
    assert bench.all("resource-request") == []
    assert {str(mutex["state"]) for mutex in bench.all("mutex")} == {"OPEN"}
    assert sorted(bench.texts("W"))[2:] == ["Unlocking resource cup", "Unlocking resource plate"]


def test_a_resource_that_another_robot_has(bench: CoordinationBench) -> None:
    bench.theirs("resource-cup")
    _goal(bench, "G", "plate cup")
    assert bench.state("G") == ("FINISHED", "REJECTED")
    assert bench.texts("W") == ["Rejecting goal G, cup is already locked by other"]
    assert bench.goal("G")["message"] == ""
    assert bench.all("resource-request") == []


def test_a_resource_that_another_goal_has(bench: CoordinationBench) -> None:
    _goal(bench, "G", "cup")
    bench.settle()
    _goal(bench, "H", "cup")
    assert bench.state("H") == ("FINISHED", "REJECTED")
    assert bench.texts("W")[-1] == "Rejecting goal H, cup is already locked for G"
    assert _acquired(bench, "G") == {"cup"}


def test_a_resource_that_another_goal_is_just_acquiring(bench: CoordinationBench) -> None:
    _goal(bench, "G", "cup")
    _goal(bench, "H", "cup")
    assert bench.state("H") == ("COMMITTED", "UNKNOWN")
    bench.settle()
    assert _acquired(bench, "G") == {"cup"}
    assert bench.state("H") == ("FINISHED", "REJECTED")


def test_all_or_nothing(bench: CoordinationBench) -> None:
    """Another robot takes one of two resources at the last moment: the other one is given back."""
    _goal(bench, "G", "cup plate")
    bench.memory._pending.clear()
    document = {"_id": "resource-cup", "locked": True, "locked-by": "me"}
    bench.memory.trigger("mutex-trigger", {"operationType": "update", "fullDocument": document})
    bench.env.run()
    assert _acquired(bench, "G") == {"cup"}
    bench.theirs("resource-plate")
    assert bench.state("G") == ("FINISHED", "REJECTED")
    assert bench.goal("G")["message"] == "Lock held by other"
    assert _acquired(bench, "G") == set()
    assert bench.mutex("resource-cup")["state"] == "OPEN"
    assert bench.all("resource-request") == []
    assert {str(mutex["request"]) for mutex in bench.all("mutex")} == {"NONE"}
    assert "Rejecting goal G, resource lock plate was rejected" in bench.texts("W")


def test_a_mutex_of_ours_that_is_locked_for_something_else_holds_the_goal(bench: CoordinationBench) -> None:
    bench.ours("resource-cup")
    _goal(bench, "G", "cup")
    bench.settle()
    assert bench.state("G") == ("COMMITTED", "UNKNOWN")
    assert _acquired(bench, "G") == set()
