"""Runs of the thesis' files, compared with the changes and firings of its recordings."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import pytest

from cxbridge.run import RunOptions
from cxbridge.run.program.plain_options import options_from_keywords
from ros2cx_tests.rows import NOT_COMPARED, read_rows, run
from tests.support import ROS2CX_DIR, SHARED, needs_ros2cx, needs_shared

DATA = Path(__file__).parent / "data"
RECORDINGS = SHARED / "traces" / "thesis"

pytestmark = [needs_ros2cx, needs_shared]


def make_options(spec: str, overlay: str | None = None, executors: tuple[str, ...] = ()) -> RunOptions:
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


def read_firings(recording: str) -> list[str]:
    """Return the fired rules of a recording in order."""
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
        ("skill", "test-skill", None, 3, ()),  # without a goal, the run ends by its timeout
        ("cancel", "cancel", "cancel.yaml", 3, ()),
        ("tree", "tree", "tree.yaml", 0, ()),
        ("fail", "fixed", "fixed.yaml", 1, (f"move={DATA / 'door.py'}:Door",)),
    ],
)
def test_changes_and_firings_equal_recording(recording, spec, overlay, status, executors):
    observed = run(make_options(spec, overlay, executors))
    assert observed.rows == read_rows(RECORDINGS / recording / "transitions.txt")
    assert observed.fired == read_firings(recording)
    assert observed.result.status == status


def test_sane_mode_lacks_only_effects_of_broken_skills_file():
    """In the original, a stale S_IDLE resets a running skill for a tick, because skills.clp lacks a rule."""
    original = read_rows(RECORDINGS / "nav2" / "transitions.txt")
    ours = run(make_options("test-nav2")).rows
    resets = [row for row in original if row.change == "S_RUNNING -> S_IDLE"]
    repeats = {index + 1 for index, row in enumerate(original) if row.change == "S_RUNNING -> S_IDLE"}
    assert len(resets) == 2
    assert ours == [row for index, row in enumerate(original) if row not in resets and index not in repeats]
