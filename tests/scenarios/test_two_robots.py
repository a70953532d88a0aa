"""scenarios/two-robots: a killed executor fails its action only, the second robot repeats the goal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.events import GoalTransition, LogLine, PlanActionTransition
from cxbridge.run import RunOptions
from cxbridge.run.agent import Run
from cxbridge.skiller.board.host import ExecutorHost
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "two-robots"
PLACES = ("kitchen", "office", "lab", "store")
WAIT_S = 60


class Watched(Run):
    """A run whose transitions are kept."""

    def __init__(self, **options: Any) -> None:
        super().__init__(RunOptions(scenario=SCENARIO, skiller="none", **options))
        self.goals: list[GoalTransition] = []
        self.actions: list[PlanActionTransition] = []
        self.lines: list[str] = []
        self.bus.subscribe(self._keep, GoalTransition, PlanActionTransition, LogLine)
        self.start()

    def _keep(self, event: Any) -> None:
        if isinstance(event, GoalTransition):
            self.goals.append(event)
        elif isinstance(event, PlanActionTransition):
            self.actions.append(event)
        else:
            self.lines.append(event.text)

    @property
    def service(self) -> Any:
        """The skill board."""
        service = self.skill_service
        assert service is not None
        return service

    def until(self, done: Callable[[], bool]) -> None:
        """Loop until something is true: for a time of the run's clock, and of ours."""
        end_us, end_s = self.clock.now_us() + 300_000_000, time.monotonic() + WAIT_S
        self.loop.run(
            lambda: done() or self.clock.now_us() > end_us or time.monotonic() > end_s,
        )
        assert done(), self.lines[-20:]

    def outcomes(self) -> dict[str, str]:
        """The outcomes of the goals at the end."""
        return {event.goal: event.outcome for event in self.goals}

    def failed(self) -> list[tuple[str, str]]:
        """Goal and name of the actions that failed."""
        return [(event.goal, event.action) for event in self.actions if event.state == "FAILED"]

    def working(self, agent: str, skill: str) -> str:
        """Return the goal of an agent's running skill, empty without a running skill."""
        for info in self.service.skill_board.executors:
            if (info.agent, info.skill, info.state) == (agent, skill, "BUSY"):
                running = {}
                for event in self.actions:
                    running[event.goal] = (event.action, event.state)
                facts = self.executive.env.facts("robot")
                goal = next(str(s["goal"]) for _, _, s in facts if s["agent"] == agent)
                if running.get(goal) == (skill, "RUNNING"):
                    return goal
        return ""


@pytest.fixture
def run() -> Iterator[Watched]:
    with Watched() as made:
        yield made


def test_two_robots_share_the_work(run):
    run.until(lambda: run.is_over)
    assert set(run.outcomes().values()) == {"COMPLETED"}
    assert {f"INSPECT-{place}" for place in PLACES} < set(run.outcomes())
    inspected = {
        agent for agent in ("robot1", "robot2") if any(f"{agent} takes" in line for line in run.lines)
    }
    assert inspected == {"robot1", "robot2"}
    assert run.failed() == []


@pytest.mark.parametrize(("victim", "skill"), [("robot1", "move"), ("robot2", "move"), ("robot1", "inspect")])
def test_dead_executor_fails_its_action_only(run, victim, skill):
    other = "robot2" if victim == "robot1" else "robot1"
    run.until(lambda: bool(run.working(victim, skill) and run.working(other, "move")))
    goal, others_goal = run.working(victim, skill), run.working(other, "move")
    name = f"{victim}-{'move' if skill == 'move' else 'camera'}"
    host = next(host for host in run.service.hosts if host.name == name)
    run.service.remove(host, ExecutorHost.abandon)
    run.until(lambda: run.is_over)
    assert run.failed() == [(goal, skill)]
    assert any(
        f"{victim} could not do {goal}: Action {skill} failed: the executor {name} is gone" in line
        for line in run.lines
    )
    taken = [line for line in run.lines if line.endswith(f" takes {goal}")]
    assert taken == [f"{victim} takes {goal}", f"{other} takes {goal}"]
    assert set(run.outcomes().values()) == {"COMPLETED"}
    assert others_goal != goal


# -- executors as processes


def executor(stack: ExitStack, url: str, target: str, agent: str, *settings: str) -> subprocess.Popen[bytes]:
    """Start an executor as a separate process."""
    command = [sys.executable, "-m", "cxbridge", "skill", "executor", target, "--agent", agent]
    command += ["--connect", url, "-q", *(part for setting in settings for part in ("--set", setting))]
    process = subprocess.Popen(command, cwd=ROOT)

    def end() -> None:
        process.terminate()
        process.wait(WAIT_S)

    stack.callback(end)
    return process


def robot(stack: ExitStack, url: str, agent: str, dock: str, speed: float) -> subprocess.Popen[bytes]:
    """Start a robot: the process of its base, and its camera."""
    settings = (f"navgraph={SCENARIO}/navgraph.yaml", f"start={dock}", f"speed={speed}", "turn=50.0")
    drive = executor(stack, url, "cxbridge.skiller.navigation:Move", agent, *settings)
    executor(stack, url, f"{SCENARIO}/camera.py:Camera", agent, "seconds=0.1")
    return drive


def test_killed_executor_process_fails_its_action(tmp_path: Path):
    elsewhere = tmp_path / "elsewhere.yaml"
    elsewhere.write_text("skill-board: {in-process: false}\n")
    with ExitStack() as stack:
        run = stack.enter_context(Watched(config=elsewhere, clock="real"))
        server = stack.enter_context(ZmqBlackBoardServer(run.board, [f"ipc://{tmp_path}/board"]))
        url = server.endpoints[0]
        slow = robot(stack, url, "robot1", "dock1", 0.05)
        robot(stack, url, "robot2", "dock2", 20.0)
        run.until(lambda: bool(run.working("robot1", "move")))
        goal = run.working("robot1", "move")
        os.kill(slow.pid, signal.SIGKILL)
        run.until(lambda: run.is_over)
        assert run.failed() == [(goal, "move")]
        taken = [line for line in run.lines if line.endswith(f" takes {goal}")]
        assert taken == [f"robot1 takes {goal}", f"robot2 takes {goal}"]
        assert set(run.outcomes().values()) == {"COMPLETED"}
