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


def test_resource_of_another_goal_rejects_goal(bench: CoordinationBench) -> None:
    _goal(bench, "G", "cup")
    bench.settle()
    _goal(bench, "H", "cup")
    assert bench.state("H") == ("FINISHED", "REJECTED")
    assert bench.texts("W")[-1] == "Rejecting goal H, cup is already locked for G"
    assert bench.env.eval("(mutex-to-resource resource-cup)") == "cup"
    assert _acquired(bench, "G") == {"cup"}


def test_goal_locks_all_resources_or_none(bench: CoordinationBench) -> None:
    """Another robot locks one of two resources at the last moment: the goal releases the second resource."""
    _goal(bench, "G", "cup plate")
    bench.memory._pending.clear()
    document = {"_id": "resource-cup", "locked": True, "locked-by": "me"}
    bench.memory.trigger("mutex-trigger", {"operationType": "update", "fullDocument": document})
    bench.env.run()
    assert _acquired(bench, "G") == {"cup"}
    bench.lock_as_other("resource-plate")
    assert bench.state("G") == ("FINISHED", "REJECTED")
    assert bench.goal("G")["message"] == "Lock held by other"
    assert _acquired(bench, "G") == set()
    assert bench.mutex("resource-cup")["state"] == "OPEN"
    assert bench.all("resource-request") == []
    assert {str(mutex["request"]) for mutex in bench.all("mutex")} == {"NONE"}
    assert "Rejecting goal G, resource lock plate was rejected" in bench.texts("W")


def test_own_mutex_without_resource_blocks_goal(bench: CoordinationBench) -> None:
    bench.acquire_own("resource-cup")
    _goal(bench, "G", "cup")
    bench.settle()
    assert bench.state("G") == ("COMMITTED", "UNKNOWN")
    assert _acquired(bench, "G") == set()
