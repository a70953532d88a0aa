"""The agents of the thesis on our own core: the same goals and actions go through the same transitions."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from cxbridge.event_kinds import View
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
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

SEQUENTIAL = [given for given in SPECS if given[0] not in ("test", "test-temporal")]
"""Those with transitions, in an order that is fixed within each plan."""


def recorded(path: Path, spec: str, overlay: Path | None, core: str | None, level: str = "rules") -> Path:
    """Record a run."""
    given = dataclasses.replace(options(spec), config=overlay, core=core, trace=path, trace_level=level)
    run_scenario(given)
    return path


def same(one: Path, other: Path, order: Order) -> bool:
    return compare_runs(open_run(one), [open_run(other)], View.TRANSITIONS, order).same


@pytest.mark.parametrize(("spec", "overlay"), SEQUENTIAL)
def test_both_cores_go_through_the_same_transitions(tmp_path, spec, overlay):
    ours = recorded(tmp_path / "ours.mcap", spec, overlay, "builtin")
    original = recorded(tmp_path / "original.mcap", spec, overlay, None)
    assert same(ours, original, Order.PARTIAL)


@pytest.mark.parametrize(("spec", "overlay"), SPECS[1:])
def test_on_both_cores_each_thing_goes_through_the_same_states(spec, overlay):
    """Actions of a temporal plan may be due at once, so only the order of each is compared here."""
    given = dataclasses.replace(options(spec), config=overlay)
    ours, original = (rows.run(dataclasses.replace(given, core=core)).rows for core in ("builtin", None))
    assert states(ours)
    assert states(ours) == states(original)


@pytest.mark.parametrize("core", [None, "builtin"])
@pytest.mark.parametrize(("spec", "overlay"), SPECS)
def test_a_run_repeats(tmp_path, spec, overlay, core):
    """Every message of the recording, byte for byte; but for how long a planner really took."""
    first, second = (
        messages(recorded(tmp_path / f"{name}.mcap", spec, overlay, core, "facts")) for name in ("one", "two")
    )
    assert first
    assert first == second


def messages(file: Path) -> list[tuple[str, int, bytes]]:
    with file.open("rb") as stream:
        return [
            (channel.topic, message.log_time, _TOOK.sub(b"", message.data))
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
        ]


@pytest.mark.parametrize("core", [None, "builtin"])
def test_the_goal_tree_ends_as_in_the_recording(core):
    """There rules of the recorder ended each action of the talk at once, here executors do after a while."""
    there = states(rows.recorded(RECORDINGS / "tree" / "transitions.txt", ["goal"]))
    given = dataclasses.replace(options("test-goals"), config=Path("goals"), core=core)
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


def test_both_cores_know_the_same_of_the_world_of_the_shipped_test():
    """Its goal reasoner is commented out: there are no transitions."""
    known = []
    for core in (None, "builtin"):
        with Run(dataclasses.replace(options("test"), core=core)) as agent:
            agent.start()
            facts = [slots["id"] for _, _, slots in agent.executive.env.facts("wm-fact")]
            known.append({str(fact) for fact in facts if not str(fact).startswith("/config")})
    assert "/domain/fact/location?robot=R-1&place=C-BS" in known[0]
    assert known[0] == known[1]


def test_the_temporal_plan_keeps_its_dispatch_times(tmp_path):
    """say-goodbye is not dispatched before 15 s have passed."""
    file = recorded(tmp_path / "temporal.mcap", "test-temporal", Path("temporal"), None)
    pending = [(time, data) for _, time, data in messages(file) if b'"PENDING"' in data]
    start = next(time for time, data in pending if b"say-hello" in data)
    later = next(time for time, data in pending if b"say-goodbye" in data)
    assert later - start == pytest.approx(14e9, abs=1e6)  # due at 15 s; ticks of 1 s, the first at 1 s
