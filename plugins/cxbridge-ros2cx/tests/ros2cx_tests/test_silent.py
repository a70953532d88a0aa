"""Executors that vanish, never answer or never begin end their action with one error; nothing hangs."""

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
from ros2cx_tests.test_recordings import DATA, options
from tests.support import needs_ros2cx

pytestmark = needs_ros2cx


class Mover(DummyExecutor):
    """A dummy with a name that is not a dummy's."""

    skills = ("move",)


class Stage:
    """A run of two actions of the agent without a name, on the virtual clock."""

    def __init__(self, prepare: Callable[[Stage, Run], None]) -> None:
        self._prepare = prepare
        self.states: list[tuple[str, str]] = []
        self.warnings: list[str] = []
        self.sent: list[str] = []

    def run(self, *, original: bool = False) -> None:
        files = [DATA / "killed.yaml", DATA / "dummies.yaml"]
        files += [DATA / "original.yaml"] if original else []
        chosen = dataclasses.replace(options("killed"), config=tuple(files), timeout=20.0)
        run_scenario(chosen, None, self._attach)

    def _attach(self, agent: Run) -> None:
        agent.bus.subscribe(self._hear, LogLine, InterfaceMessage)
        agent.loop.add(Hook.POST_LOOP, lambda: self._look(agent))
        self._prepare(self, agent)

    def _hear(self, event: Event) -> None:
        if isinstance(event, InterfaceMessage):
            self.sent.append(event.message.removesuffix("Message"))
        elif isinstance(event, LogLine) and event.level is Level.WARN and event.component == "SkillBoard":
            self.warnings.append(event.text)

    def _look(self, agent: Run) -> None:
        facts = sorted((s for _, _, s in agent.executive.env.facts("plan-action")), key=lambda s: s["id"])
        self.states = [(str(slots["state"]), str(slots["error-msg"])) for slots in facts]


def host_in(agent: Run) -> ExecutorHost:
    return make_host(Mover, ExecutorContext("default", agent.board, agent.clock, agent.bus.logger("e")), "e")


def test_no_dummy_takes_the_place_of_an_executor_that_is_gone():
    def prepare(_stage: Stage, agent: Run) -> None:
        host = host_in(agent)
        steps = [0]

        def loop() -> None:
            steps[0] += 1
            if steps[0] < 20:
                host.loop()
            elif steps[0] == 20:
                assert host.state is ExecutorState.BUSY
                host.abandon()

        agent.loop.add(Hook.ACT, loop)

    stage = Stage(prepare)
    stage.run()
    gone, nobody = "the executor e is gone", "the agent default has no executor"
    assert [error for _, error in stage.states] == [gone, nobody]
    assert stage.warnings == [
        f"action 1: move of default FAILED: {gone}",
        f"action 2: move of default FAILED: {nobody}",
    ]


def mute(answer: bool) -> Callable[[Stage, Run], None]:
    """Bring an executor to the blackboard that never answers, or answers and never begins."""

    def prepare(_stage: Stage, agent: Run) -> None:
        interface: Any = agent.board.open_for_writing("SkillExecutorInterface", "mute", owner="test")
        interface.agent, interface.skills = "default", "move"
        interface.write()

        def loop() -> None:
            while (message := interface.msgq_pop()) is not None:
                if answer and message.type == "RequestMessage":
                    with agent.board.open_for_reading(
                        "SkillBoardInterface", "SkillBoard", owner="test"
                    ) as board:
                        reply = board.create_message("ResponseMessage")
                        reply.set("epoch", message.epoch)
                        reply.set("master", message.master)
                        reply.set("executor", "mute")
                        board.msgq_enqueue(reply)

        agent.loop.add(Hook.ACT, loop)

    return prepare


def test_an_executor_that_never_begins_is_told_to_stop_and_is_one_error_an_action():
    stage = Stage(mute(answer=True))
    stage.run()
    error = "the executor mute did not begin for 4 s"
    assert [found for _, found in stage.states] == [error, error]
    assert stage.sent == ["Request", "Response", "Confirm", "Cancel"] * 2


def test_in_the_original_who_is_not_answered_gives_up_after_more_than_4_s():
    stage = Stage(mute(answer=False))
    stage.run(original=True)
    text = (
        "Timed out (4s) waiting for response from execution node for agent  and skill (move tb3 wp_init wp{})"
    )
    assert [found for _, found in stage.states] == [text.format(1), text.format(2)]


@pytest.mark.parametrize("original", [False, True])
def test_an_executor_that_is_busy_for_a_stranger_is_asked_later_by_default(original):
    """By default the master asks again when it is free; the original asks once."""

    def prepare(_stage: Stage, agent: Run) -> None:
        interface: Any = agent.board.open_for_writing("SkillExecutorInterface", "e", owner="test")
        interface.agent, interface.skills, interface.state = "default", "move", "BUSY"
        interface.write()
        loops = [0]

        def loop() -> None:
            loops[0] += 1
            if loops[0] == 10:
                interface.close()
                host = host_in(agent)
                agent.loop.add(Hook.ACT, host.loop)

        agent.loop.add(Hook.ACT, loop)

    stage = Stage(prepare)
    stage.run(original=original)
    assert stage.states[0][1].startswith("Timed out (4s)") == original
