"""The move executor, which replaces an example node of the original."""

from __future__ import annotations

import dataclasses
import math
import re

import pytest

from cxbridge.clock import MICROSECONDS
from cxbridge.history.exchange import ExchangeReader
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge_ros2cx.executors import MoveExecutor
from ros2cx_tests.rows import run
from ros2cx_tests.test_recordings import make_options
from tests.skiller.board.rig import Rig, states
from tests.support import needs_ros2cx

MOVE = ("move=cxbridge_ros2cx.executors:MoveExecutor",)
REMAINING = re.compile(r"Move running: ([\d.]+) m remaining at 0\.22 m/s")


@pytest.fixture
def rig():
    instance = Rig()
    yield instance
    instance.close()


def drive(rig: Rig, to: str):
    """Request a move, and return its master, the executor, and the feedback until the end."""
    skills: SkillBoard = rig.skills()
    executor = rig.puppet("r1", "e1", MoveExecutor)  # type: ignore[arg-type]
    feedback = []
    master = skills.request(
        SkillCall("move", "r1", {"1": "tb3", "2": "wp_init", "3": to}),
        lambda m: feedback.append((m.progress, m.feedback)),
    )
    rig.until(lambda: master.is_over)
    return master, executor, feedback


def test_move_has_constant_speed_and_remaining_distance_as_feedback(rig):
    start_us = rig.clock.now_us()
    master, executor, feedback = drive(rig, "wp1")
    seconds = (rig.clock.now_us() - start_us) / MICROSECONDS
    distance = math.dist((-2.0, -0.4), (1.76, 0.68))
    assert (states(master), feedback[-1]) == (["SUCCEEDED"], (1.0, "Move completed"))
    assert executor.position == (1.76, 0.68)
    assert seconds == pytest.approx(distance / 0.22, abs=0.2)
    assert (0.0, "Move starting") in feedback
    remaining = [float(match[1]) for _, text in feedback if (match := REMAINING.fullmatch(text))]
    assert remaining == sorted(remaining, reverse=True)
    assert len(set(remaining)) == pytest.approx(seconds / 0.5, abs=2)
    for progress, text in feedback:
        if match := REMAINING.fullmatch(text):
            assert float(match[1]) == pytest.approx(distance * (1 - progress), abs=0.01)


@needs_ros2cx
def test_thesis_scenario_with_move_executor():
    run_options = dataclasses.replace(make_options("test-nav2", executors=MOVE), timeout=200.0)
    observed = run(run_options)
    assert observed.result.status == 0
    messages = [message for message, _ in ExchangeReader().read(observed.messages)]
    ends = [message for message in messages if message.type == "FINISH"]
    assert [(end.success, end.progress, end.status) for end in ends] == [(True, 1.0, "Move completed")] * 7
    assert [end.params[2] for end in ends] == ["wp1", "wp2", "wp3", "wp4", "wp5", "wp6", "wp_final"]
