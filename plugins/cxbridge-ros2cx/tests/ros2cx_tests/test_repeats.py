"""Repeated runs of the thesis' agents, with shipped configurations, too."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from cxbridge.run import run_scenario
from ros2cx_tests import rows
from ros2cx_tests.test_recordings import DATA, RECORDINGS, make_options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx

_DURATION = re.compile(rb'"duration_us":[0-9]+')
_NUMBER = re.compile(r"gen<?[0-9]+>?")

SPECS = [
    ("test", None),
    ("test-nav2", None),
    ("test-pddl", None),
    ("test-skill", None),
    ("test-goals", Path("goals")),  # this overlay and the next are shipped
    ("test-temporal", Path("temporal")),
    ("tree", DATA / "tree-sane.yaml"),
]


def record_run(path: Path, spec: str, overlay: Path | None) -> Path:
    """Record a run."""
    run_options = dataclasses.replace(make_options(spec), config=overlay, trace=path, trace_level="facts")
    run_scenario(run_options)
    return path


@pytest.mark.parametrize(("spec", "overlay"), SPECS)
def test_repeated_runs_have_same_messages(tmp_path, spec, overlay):
    """All messages are equal except for the real duration of planners."""
    first, second = (
        read_messages(record_run(tmp_path / f"{name}.mcap", spec, overlay)) for name in ("first", "second")
    )
    assert first
    assert first == second


def read_messages(file: Path) -> list[tuple[str, int, bytes]]:
    with file.open("rb") as stream:
        return [
            (channel.topic, message.log_time, _DURATION.sub(b"", message.data))
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
            # the watchdog's warning depends on the load of the machine, not on the run's clock
            if b"does not end" not in message.data
        ]


def test_goal_tree_ends_like_recording():
    """Executors end the talk actions later than the rules of the recorder, with the same goal states."""
    expected = find_states(rows.read_rows(RECORDINGS / "tree" / "transitions.txt", ["goal"]))
    run_options = dataclasses.replace(make_options("test-goals"), config=Path("goals"))
    assert find_states(rows.run(run_options).rows, "goal") == expected


def find_states(changes: Iterable[rows.Row], *kinds: str) -> list[tuple[str, tuple[str, ...]]]:
    """Return the states of each fact without numbers in names and without `executable`.

    The original never withdraws `executable`.
    """
    changes_by_key: dict[str, list[str]] = {}
    for row in changes:
        change = _NUMBER.sub("gen", row.change.replace(" exec", ""))
        before, arrow, after = change.partition(" -> ")
        if (not kinds or row.kind in kinds) and not (arrow and before == after):
            changes_by_key.setdefault(f"{row.kind} {row.key}", []).append(change)
    return sorted((_NUMBER.sub("gen", name), tuple(states)) for name, states in changes_by_key.items())


def test_temporal_plan_keeps_dispatch_times(tmp_path):
    """The dispatch time of say-goodbye is 15 s."""
    file = record_run(tmp_path / "temporal.mcap", "test-temporal", Path("temporal"))
    pending = [(time, data) for _, time, data in read_messages(file) if b'"PENDING"' in data]
    start = next(time for time, data in pending if b"say-hello" in data)
    end = next(time for time, data in pending if b"say-goodbye" in data)
    assert end - start == pytest.approx(14e9, abs=1e6)  # due at 15 s; ticks of 1 s, the first at 1 s
