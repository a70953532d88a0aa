"""The thesis' own files behave here as in its recordings, change by change, rule by rule."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import pytest

from cxbridge.run import RunOptions
from cxbridge.run.program.plain_options import options_from_keywords
from ros2cx_tests.rows import NOT_COMPARED, recorded, run
from tests.support import ROS2CX_DIR, SHARED, needs_ros2cx, needs_shared

DATA = Path(__file__).parent / "data"
RECORDINGS = SHARED / "traces" / "thesis"

pytestmark = [needs_ros2cx, needs_shared]


def options(spec: str, overlay: str | None = None, executors: tuple[str, ...] = ()) -> RunOptions:
    return options_from_keywords(
        None,
        ros2cx=ROS2CX_DIR,
        spec=spec,
        config=DATA / overlay if overlay else None,
        executors=executors,
        clips_dirs=(DATA, RECORDINGS / "clips"),
        timeout=40.0,
        trace_level="rules",
    )


def fired(recording: str) -> list[str]:
    """The rules that fired, in order."""
    with gzip.open(RECORDINGS / recording / "cx_node.log.gz", "rt") as file:
        rules = re.findall(r"FIRE +\d+ ([^:]+):", file.read())
    return [rule for rule in rules if rule not in NOT_COMPARED]


@pytest.mark.parametrize(
    ("recording", "spec", "overlay", "status", "executors"),
    [
        ("nav2", "test-nav2", "nav2.yaml", 0, ()),
        ("nav2-fixed", "fixed", "fixed.yaml", 0, ()),
        ("two-executors", "fixed", "two-executors.yaml", 0, ()),
        ("no-plan", "test-nav2", "no-plan.yaml", 1, ()),
        ("skill", "test-skill", None, 3, ()),  # it has no goal: it runs until its time is over
        ("cancel", "cancel", "cancel.yaml", 3, ()),
        ("tree", "tree", "tree.yaml", 0, ()),
        ("fail", "fixed", "fixed.yaml", 1, (f"move={DATA / 'door.py'}:Door",)),
    ],
)
def test_changes_are_those_of_the_recording(recording, spec, overlay, status, executors):
    watched = run(options(spec, overlay, executors))
    assert watched.rows == recorded(RECORDINGS / recording / "transitions.txt")
    assert watched.fired == fired(recording)
    assert watched.result.status == status


def test_the_sane_mode_differs_by_what_the_broken_skills_file_does_only():
    """A stale S_IDLE sets a running skill back for a tick, because a rule of skills.clp is never defined."""
    there = recorded(RECORDINGS / "nav2" / "transitions.txt")
    ours = run(options("test-nav2")).rows
    flaps = [row for row in there if row.change == "S_RUNNING -> S_IDLE"]
    again = {index + 1 for index, row in enumerate(there) if row.change == "S_RUNNING -> S_IDLE"}
    assert len(flaps) == 2
    assert ours == [row for index, row in enumerate(there) if row not in flaps and index not in again]
