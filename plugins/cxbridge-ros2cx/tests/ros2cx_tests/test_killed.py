"""kill -9 of an executor in each of its states ends as docs/evidence/thesis-facts.md says, in both modes."""

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
from ros2cx_tests.test_recordings import DATA, options
from tests.support import ROOT, needs_ros2cx

pytestmark = needs_ros2cx

WAIT_S = 60.0
HEARTBEAT_S = 0.2
LOOPS_FOR_EVER = 60

GONE = "the executor e is gone"
NOBODY = "the agent default has no executor"
TIMED_OUT = (
    "Timed out (4s) waiting for response from execution node for agent  and skill (move tb3 wp_init wp{})"
)
FIRST_IS_LOST = [("EXECUTION-FAILED", GONE), ("EXECUTION-FAILED", NOBODY)]
FOR_EVER = [("RUNNING", ""), ("PENDING", "")]

ENDS = {
    # killed when it has ...: the ends of two actions by default, and as in the original
    "nothing": (
        [("EXECUTION-FAILED", NOBODY), ("EXECUTION-FAILED", NOBODY)],
        [("EXECUTION-FAILED", TIMED_OUT.format(1)), ("EXECUTION-FAILED", TIMED_OUT.format(2))],
    ),
    "responded": (FIRST_IS_LOST, FOR_EVER),
    "confirmed": (FIRST_IS_LOST, FOR_EVER),
    "running": (FIRST_IS_LOST, FOR_EVER),
    "finished": (
        [("EXECUTION-SUCCEEDED", ""), ("EXECUTION-FAILED", NOBODY)],
        [("EXECUTION-SUCCEEDED", ""), ("EXECUTION-FAILED", TIMED_OUT.format(2))],
    ),
}


class Executor:
    """An executor in a process that is killed at a point, and the run's view of it."""

    def __init__(self, folder: Path, point: str) -> None:
        self._url = f"ipc://{folder}/board"
        self._point = point
        self.states: list[tuple[str, str]] = []
        self._loops_after_death = 0
        self._popen: subprocess.Popen[bytes] | None = None
        self._server: ZmqBlackBoardServer | None = None

    def attach(self, agent: Run) -> None:
        """Begin before the run does."""
        self._server = ZmqBlackBoardServer(agent.board, [self._url], heartbeat=HEARTBEAT_S)
        self._server.start()
        command = [sys.executable, str(DATA / "dying.py"), self._point, self._url]
        self._popen = subprocess.Popen(command, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)})
        self._until(lambda: self._is_there(agent))
        if self._point == "nothing":
            self._popen.send_signal(signal.SIGKILL)
            self._until(lambda: not self._is_there(agent))
        agent.loop.add(Hook.POST_LOOP, lambda: self._look(agent))

    def _is_there(self, agent: Run) -> bool:
        return any(info.has_writer for info in agent.board.list("SkillExecutorInterface"))

    def _until(self, done: Callable[[], bool]) -> None:
        end_s = time.monotonic() + WAIT_S
        while not done():
            assert time.monotonic() < end_s
            time.sleep(0.01)

    def _look(self, agent: Run) -> None:
        """Note how the actions stand; end the run when nothing will change any more."""
        facts = sorted(
            (slots for _, _, slots in agent.executive.env.facts("plan-action")), key=lambda s: s["id"]
        )
        self.states = [(_outcome(str(slots["state"])), str(slots["error-msg"])) for slots in facts]
        assert self._popen is not None
        if self._popen.poll() is not None and not self._is_there(agent):
            self._loops_after_death += 1
        over = facts and all(state.startswith("EXECUTION") for state, _ in self.states)
        if over or (self.states[:1] == FOR_EVER[:1] and self._loops_after_death > LOOPS_FOR_EVER):
            agent.loop.stop()

    def close(self) -> None:
        if self._popen is not None:
            self._popen.kill()
            assert self._popen.wait(WAIT_S) == -signal.SIGKILL
        if self._server is not None:
            self._server.stop()


def _outcome(state: str) -> str:
    """A state, with those after the execution as that."""
    if state == "FAILED":
        return "EXECUTION-FAILED"
    if state in ("SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD", "EFFECTS-APPLIED", "FINAL"):
        return "EXECUTION-SUCCEEDED"
    return state


@pytest.fixture
def executor(tmp_path: Path, point: str) -> Iterator[Executor]:
    made = Executor(tmp_path, point)
    yield made
    made.close()


@pytest.mark.parametrize("mode", ["sane", "original"])
@pytest.mark.parametrize("point", ENDS)
def test_kill_9_ends_as_documented(executor, point, mode):
    files = [DATA / "killed.yaml", *([DATA / "original.yaml"] if mode == "original" else [])]
    chosen = dataclasses.replace(options("killed"), config=tuple(files), clock="real", timeout=WAIT_S)
    run_scenario(chosen, None, executor.attach)
    assert executor.states == ENDS[point][mode == "original"]
