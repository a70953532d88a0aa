"""The kill of an executor in each state, with the results of docs/evidence/thesis-facts.md."""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from ros2cx_tests.test_recordings import DATA, make_options
from tests.support import ROOT, needs_ros2cx

pytestmark = needs_ros2cx

WAIT_S = 60.0
HEARTBEAT_S = 0.2
LOOPS_WHEN_ENDLESS = 60

EXECUTOR_GONE = "the executor e is gone"
NO_EXECUTOR = "the agent default has no executor"
TIMED_OUT = (
    "Timed out (4s) waiting for response from execution node for agent  and skill (move tb3 wp_init wp{})"
)
FIRST_ACTION_LOST = [("EXECUTION-FAILED", EXECUTOR_GONE), ("EXECUTION-FAILED", NO_EXECUTOR)]
ENDLESS = [("RUNNING", ""), ("PENDING", "")]

ENDS = {
    # the state of the kill: the ends of two actions in the sane and in the original mode
    "nothing": (
        [("EXECUTION-FAILED", NO_EXECUTOR), ("EXECUTION-FAILED", NO_EXECUTOR)],
        [("EXECUTION-FAILED", TIMED_OUT.format(1)), ("EXECUTION-FAILED", TIMED_OUT.format(2))],
    ),
    "responded": (FIRST_ACTION_LOST, ENDLESS),
    "confirmed": (FIRST_ACTION_LOST, ENDLESS),
    "running": (FIRST_ACTION_LOST, ENDLESS),
    "finished": (
        [("EXECUTION-SUCCEEDED", ""), ("EXECUTION-FAILED", NO_EXECUTOR)],
        [("EXECUTION-SUCCEEDED", ""), ("EXECUTION-FAILED", TIMED_OUT.format(2))],
    ),
}


class Executor:
    """An executor in a process that is killed at a point, and the states of the actions."""

    def __init__(self, folder: Path, point: str) -> None:
        self._url = f"ipc://{folder}/board"
        self._point = point
        self.states: list[tuple[str, str]] = []
        self._loops_after_death = 0
        self._popen: subprocess.Popen[bytes] | None = None
        self._server: ZmqBlackBoardServer | None = None

    def attach(self, agent: Run) -> None:
        """Start the executor before the run."""
        self._server = ZmqBlackBoardServer(agent.board, [self._url], heartbeat=HEARTBEAT_S)
        self._server.start()
        command = [sys.executable, str(DATA / "dying.py"), self._point, self._url]
        self._popen = subprocess.Popen(command, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)})
        self._wait_until(lambda: self._has_executor(agent))
        if self._point == "nothing":
            self._popen.send_signal(signal.SIGKILL)
            self._wait_until(lambda: not self._has_executor(agent))
        agent.loop.add(Hook.POST_LOOP, lambda: self._record_states(agent))

    def _has_executor(self, agent: Run) -> bool:
        return any(info.has_writer for info in agent.board.list("SkillExecutorInterface"))

    def _wait_until(self, done: Callable[[], bool]) -> None:
        end_s = time.monotonic() + WAIT_S
        while not done():
            assert time.monotonic() < end_s
            time.sleep(0.01)

    def _record_states(self, agent: Run) -> None:
        """Record the states of the actions, and stop the run after the last change."""
        facts = sorted(
            (slots for _, _, slots in agent.executive.env.facts("plan-action")), key=lambda s: s["id"]
        )
        self.states = [(_outcome(str(slots["state"])), str(slots["error-msg"])) for slots in facts]
        assert self._popen is not None
        if self._popen.poll() is not None and not self._has_executor(agent):
            self._loops_after_death += 1
        is_over = facts and all(state.startswith("EXECUTION") for state, _ in self.states)
        if is_over or (self.states[:1] == ENDLESS[:1] and self._loops_after_death > LOOPS_WHEN_ENDLESS):
            agent.loop.stop()

    def close(self) -> None:
        if self._popen is not None:
            self._popen.kill()
            assert self._popen.wait(WAIT_S) == -signal.SIGKILL
        if self._server is not None:
            self._server.stop()


def _outcome(state: str) -> str:
    """Return a state, with later states replaced by the end of the execution."""
    if state == "FAILED":
        return "EXECUTION-FAILED"
    if state in ("SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD", "EFFECTS-APPLIED", "FINAL"):
        return "EXECUTION-SUCCEEDED"
    return state


@pytest.fixture
def executor(tmp_path: Path, point: str) -> Iterator[Executor]:
    instance = Executor(tmp_path, point)
    yield instance
    instance.close()


@pytest.mark.parametrize("mode", ["sane", "original"])
@pytest.mark.parametrize("point", ENDS)
def test_killed_executor_ends_actions_as_documented(executor, point, mode):
    files = [DATA / "killed.yaml", *([DATA / "original.yaml"] if mode == "original" else [])]
    run_options = dataclasses.replace(
        make_options("killed"), config=tuple(files), clock="real", timeout=WAIT_S
    )
    run_scenario(run_options, None, executor.attach)
    assert executor.states == ENDS[point][mode == "original"]
