"""The agents of the thesis on our own core: the same goals and actions go through the same transitions."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from cxbridge.app import run_scenario
from cxbridge.trace.compare.result import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.levels import View
from tests.ros2cx.test_recordings import options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx

SPECS = [("test-nav2", None), ("test-pddl", None), ("test-skill", None), ("tree", "tree-sane.yaml")]


def recorded(path: Path, spec: str, overlay: str | None, core: str | None) -> Path:
    """Record a run."""
    run_scenario(dataclasses.replace(options(spec, overlay), core=core, trace=path))
    return path


def same(one: Path, other: Path, order: Order) -> bool:
    return compare_runs(open_run(one), [open_run(other)], View.TRANSITIONS, order).same


@pytest.mark.parametrize(("spec", "overlay"), SPECS)
def test_both_cores_go_through_the_same_transitions(tmp_path, spec, overlay):
    ours = recorded(tmp_path / "ours.mcap", spec, overlay, "builtin")
    original = recorded(tmp_path / "original.mcap", spec, overlay, None)
    assert same(ours, original, Order.PARTIAL)


@pytest.mark.parametrize("core", [None, "builtin"])
@pytest.mark.parametrize(("spec", "overlay"), SPECS)
def test_a_run_repeats(tmp_path, spec, overlay, core):
    first, second = (recorded(tmp_path / f"{name}.mcap", spec, overlay, core) for name in ("one", "two"))
    assert same(first, second, Order.TOTAL)
