"""A run of the thesis' agents repeats, with the configurations that ship, too."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from cxbridge.run import run_scenario
from ros2cx_tests import rows
from ros2cx_tests.test_recordings import DATA, RECORDINGS, options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx

_TOOK = re.compile(rb'"duration_us":[0-9]+')
_NUMBER = re.compile(r"gen<?[0-9]+>?")

SPECS = [
    ("test", None),
    ("test-nav2", None),
    ("test-pddl", None),
    ("test-skill", None),
    ("test-goals", Path("goals")),  # shipped, as is the next
    ("test-temporal", Path("temporal")),
    ("tree", DATA / "tree-sane.yaml"),
]


def recorded(path: Path, spec: str, overlay: Path | None) -> Path:
    """Record a run."""
    given = dataclasses.replace(options(spec), config=overlay, trace=path, trace_level="facts")
    run_scenario(given)
    return path


@pytest.mark.parametrize(("spec", "overlay"), SPECS)
def test_a_run_repeats(tmp_path, spec, overlay):
    """Every message of the recording, byte for byte; but for how long a planner really took."""
    first, second = (messages(recorded(tmp_path / f"{name}.mcap", spec, overlay)) for name in ("one", "two"))
    assert first
    assert first == second


def messages(file: Path) -> list[tuple[str, int, bytes]]:
    with file.open("rb") as stream:
        return [
            (channel.topic, message.log_time, _TOOK.sub(b"", message.data))
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
            # the watchdog's warning depends on the load of the machine, not on the run's clock
            if b"does not end" not in message.data
        ]


def test_the_goal_tree_ends_as_in_the_recording():
    """There rules of the recorder ended each action of the talk at once, here executors do after a while."""
    there = states(rows.recorded(RECORDINGS / "tree" / "transitions.txt", ["goal"]))
    given = dataclasses.replace(options("test-goals"), config=Path("goals"))
    assert states(rows.run(given).rows, "goal") == there


def states(changes: Iterable[rows.Row], *kinds: str) -> list[tuple[str, tuple[str, ...]]]:
    """What becomes of each goal, action ...: without the numbers in names, and without `executable`.

    The original never withdraws that.
    """
    things: dict[str, list[str]] = {}
    for row in changes:
        change = _NUMBER.sub("gen", row.change.replace(" exec", ""))
        before, arrow, after = change.partition(" -> ")
        if (not kinds or row.kind in kinds) and not (arrow and before == after):
            things.setdefault(f"{row.kind} {row.key}", []).append(change)
    return sorted((_NUMBER.sub("gen", name), tuple(done)) for name, done in things.items())


def test_the_temporal_plan_keeps_its_dispatch_times(tmp_path):
    """say-goodbye is not dispatched before 15 s have passed."""
    file = recorded(tmp_path / "temporal.mcap", "test-temporal", Path("temporal"))
    pending = [(time, data) for _, time, data in messages(file) if b'"PENDING"' in data]
    start = next(time for time, data in pending if b"say-hello" in data)
    later = next(time for time, data in pending if b"say-goodbye" in data)
    assert later - start == pytest.approx(14e9, abs=1e6)  # due at 15 s; ticks of 1 s, the first at 1 s
