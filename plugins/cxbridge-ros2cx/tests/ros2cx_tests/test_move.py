"""The executors that ship for the original's example nodes: the dummy, and the one that drives."""

from __future__ import annotations

import dataclasses
import math
import re

import pytest

from cxbridge.clock import MICROSECONDS
from cxbridge.history.exchange import Exchange
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge_ros2cx.executors import MoveExecutor
from ros2cx_tests.rows import run
from ros2cx_tests.test_recordings import options
from tests.skiller.board.rig import Rig, states
from tests.support import needs_ros2cx

MOVE = ("move=cxbridge_ros2cx.executors:MoveExecutor",)
REMAINING = re.compile(r"Move running: ([\d.]+) m remaining at 0\.22 m/s")


@pytest.fixture
def rig():
    made = Rig()
    yield made
    made.close()


def drive(rig: Rig, to: str):
    """Ask for a move; return its master, the executor, and the messages until its end."""
    skills: SkillBoard = rig.skills()
    executor = rig.puppet("r1", "e1", MoveExecutor)  # type: ignore[arg-type]
    told = []
    master = skills.request(
        SkillCall("move", "r1", {"1": "tb3", "2": "wp_init", "3": to}),
        lambda m: told.append((m.progress, m.feedback)),
    )
    rig.until(lambda: master.is_over)
    return master, executor, told


def test_it_drives_at_its_speed_and_tells_the_distance_remaining(rig):
    start_us = rig.clock.now_us()
    master, executor, told = drive(rig, "wp1")
    seconds = (rig.clock.now_us() - start_us) / MICROSECONDS
    distance = math.dist((-2.0, -0.4), (1.76, 0.68))
    assert (states(master), told[-1]) == (["SUCCEEDED"], (1.0, "Move completed"))
    assert executor.position == (1.76, 0.68)
    assert seconds == pytest.approx(distance / 0.22, abs=0.2)
    assert (0.0, "Move starting") in told
    remaining = [float(match[1]) for _, text in told if (match := REMAINING.fullmatch(text))]
    assert remaining == sorted(remaining, reverse=True)
    assert len(set(remaining)) == pytest.approx(seconds / 0.5, abs=2)
    for share, text in told:
        if match := REMAINING.fullmatch(text):
            assert float(match[1]) == pytest.approx(distance * (1 - share), abs=0.01)


@needs_ros2cx
def test_the_thesis_scenario_with_the_driving_executor():
    chosen = dataclasses.replace(options("test-nav2", executors=MOVE), timeout=200.0)
    watched = run(chosen)
    assert watched.result.status == 0
    messages = [message for message, _ in Exchange().read(watched.messages)]
    ends = [message for message in messages if message.type == "FINISH"]
    assert [(end.success, end.progress, end.status) for end in ends] == [(True, 1.0, "Move completed")] * 7
    assert [end.params[2] for end in ends] == ["wp1", "wp2", "wp3", "wp4", "wp5", "wp6", "wp_final"]
