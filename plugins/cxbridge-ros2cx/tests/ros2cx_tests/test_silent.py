"""Executors that vanish, never answer or never start."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import pytest

from cxbridge.events import Event, InterfaceMessage, Level, LogLine
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.skiller.board.host import ExecutorHost, make_host
from cxbridge.skiller.board.protocol import ExecutorState
from cxbridge_ros2cx.executors import DummyExecutor
from ros2cx_tests.test_recordings import DATA, make_options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx


class Move(DummyExecutor):
    """A dummy that is not named like a dummy."""

    skills = ("move",)


class ObservedRun:
    """A run with two actions of the unnamed agent, on the virtual clock."""

    def __init__(self, prepare: Callable[[ObservedRun, Run], None]) -> None:
        self._prepare = prepare
        self.states: list[tuple[str, str]] = []
        self.warnings: list[str] = []
        self.sent: list[str] = []

    def run(self, *, original: bool = False) -> None:
        files = [DATA / "killed.yaml", DATA / "dummies.yaml"]
        files += [DATA / "original.yaml"] if original else []
        run_options = dataclasses.replace(make_options("killed"), config=tuple(files), timeout=20.0)
        run_scenario(run_options, None, self._attach)

    def _attach(self, agent: Run) -> None:
        agent.bus.subscribe(self._record_event, LogLine, InterfaceMessage)
        agent.loop.add(Hook.POST_LOOP, lambda: self._record_states(agent))
        self._prepare(self, agent)

    def _record_event(self, event: Event) -> None:
        if isinstance(event, InterfaceMessage):
            self.sent.append(event.message.removesuffix("Message"))
        elif isinstance(event, LogLine) and event.level is Level.WARN and event.component == "SkillBoard":
            self.warnings.append(event.text)

    def _record_states(self, agent: Run) -> None:
        facts = sorted((s for _, _, s in agent.executive.env.facts("plan-action")), key=lambda s: s["id"])
        self.states = [(str(slots["state"]), str(slots["error-msg"])) for slots in facts]


def make_host_in(agent: Run) -> ExecutorHost:
    return make_host(Move, ExecutorContext("default", agent.board, agent.clock, agent.bus.logger("e")), "e")


def test_vanished_executor_is_not_replaced_by_dummy():
    def prepare(_observed: ObservedRun, agent: Run) -> None:
        host = make_host_in(agent)
        steps = [0]

        def loop() -> None:
            steps[0] += 1
            if steps[0] < 20:
                host.loop()
            elif steps[0] == 20:
                assert host.state is ExecutorState.BUSY
                host.abandon()

        agent.loop.add(Hook.ACT, loop)

    observed = ObservedRun(prepare)
    observed.run()
    gone, no_executor = "the executor e is gone", "the agent default has no executor"
    assert [error for _, error in observed.states] == [gone, no_executor]
    assert observed.warnings == [
        f"action 1: move of default FAILED: {gone}",
        f"action 2: move of default FAILED: {no_executor}",
    ]


def add_silent_executor(answers: bool) -> Callable[[ObservedRun, Run], None]:
    """Return a function that adds an executor without responses, or with responses and without a start."""

    def prepare(_observed: ObservedRun, agent: Run) -> None:
        interface: Any = agent.board.open_for_writing("SkillExecutorInterface", "silent", owner="test")
        interface.agent, interface.skills = "default", "move"
        interface.write()

        def loop() -> None:
            while (message := interface.msgq_pop()) is not None:
                if answers and message.type == "RequestMessage":
                    with agent.board.open_for_reading(
                        "SkillBoardInterface", "SkillBoard", owner="test"
                    ) as board:
                        reply = board.create_message("ResponseMessage")
                        reply.set("epoch", message.epoch)
                        reply.set("master", message.master)
                        reply.set("executor", "silent")
                        board.msgq_enqueue(reply)

        agent.loop.add(Hook.ACT, loop)

    return prepare


def test_executor_that_never_starts_is_cancelled():
    observed = ObservedRun(add_silent_executor(answers=True))
    observed.run()
    error = "the executor silent did not begin for 4 s"
    assert [error_text for _, error_text in observed.states] == [error, error]
    assert observed.sent == ["Request", "Response", "Confirm", "Cancel"] * 2


def test_original_master_without_response_times_out():
    observed = ObservedRun(add_silent_executor(answers=False))
    observed.run(original=True)
    text = (
        "Timed out (4s) waiting for response from execution node for agent  and skill (move tb3 wp_init wp{})"
    )
    assert [error_text for _, error_text in observed.states] == [text.format(1), text.format(2)]


@pytest.mark.parametrize("original", [False, True])
def test_sane_master_repeats_request_to_busy_executor(original):
    """The master of the sane mode repeats a request, and the master of the original does not."""

    def prepare(_observed: ObservedRun, agent: Run) -> None:
        interface: Any = agent.board.open_for_writing("SkillExecutorInterface", "e", owner="test")
        interface.agent, interface.skills, interface.state = "default", "move", "BUSY"
        interface.write()
        loops = [0]

        def loop() -> None:
            loops[0] += 1
            if loops[0] == 10:
                interface.close()
                host = make_host_in(agent)
                agent.loop.add(Hook.ACT, host.loop)

        agent.loop.add(Hook.ACT, loop)

    observed = ObservedRun(prepare)
    observed.run(original=original)
    assert observed.states[0][1].startswith("Timed out (4s)") == original
