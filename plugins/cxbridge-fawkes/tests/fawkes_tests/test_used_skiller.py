"""A Skiller with earlier clients: only the status of the client's own message counts.

All senders number their messages from 1, so the last message of an earlier client may have an equal id.
A client that took the old status for its own would report the first skill as final without execution.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from uuid import uuid4

import pytest

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.run import RunOptions, run_scenario
from cxbridge.skiller.calls import CallOutcome, SkillerCall
from cxbridge_fawkes.gateway import Gateway
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.remote_skiller import RemoteSkiller
from tests.cli.boards import WAIT_S
from tests.run.mini import write_scenario
from tests.run.used_skiller import OTHERS_SKILL, STATES, UsedSkiller
from tests.support import share

IDS = (0, 1, 2, 3, 4, 5, 6, 65534, 65535)
"""Ids of the last message: those of a new sender's first messages, and the largest ids."""

TRANSPORTS = ("zmq", "fawkes", "gateway")
"""The transports to a remote Skiller; a Skiller of the same process has no earlier clients."""


@contextmanager
def serve_skiller(skiller: UsedSkiller, transport: str, folder) -> Iterator[str]:
    """Serve the Skiller's blackboard, and yield the URL."""
    with ExitStack() as stack:
        if transport == "zmq":
            server = stack.enter_context(ZmqBlackBoardServer(skiller.board, [f"ipc://{folder}/robot"]))
            yield server.endpoints[0]
            return
        port = stack.enter_context(FawkesServer(skiller.board, port=0)).port
        url = f"fawkes://127.0.0.1:{port}"
        if transport == "fawkes":
            yield url
            return
        clock = RealClock()
        middle = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), clock))
        robot = stack.enter_context(open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)))
        gateway = stack.enter_context(Gateway(robot, middle, ["SkillerInterface"]))
        gateway.start()
        while not gateway.mirrors():
            time.sleep(0.002)
        server = stack.enter_context(ZmqBlackBoardServer(middle, [f"ipc://{folder}/middle"]))
        yield server.endpoints[0]


class StatusRecorder(Listener):
    """Records the states of an executive's interface in the order of the writes."""

    def __init__(self) -> None:
        self.states: list[tuple[str, str, int]] = []
        self.changed = threading.Condition()

    def data_changed(self, interface) -> None:
        interface.read()
        with self.changed:
            state = (interface.status.name, interface.skill_string, interface.msgid)
            if state not in self.states[-1:]:
                self.states.append(state)
            self.changed.notify_all()

    def wait_for(self, interface, condition) -> None:
        with self.changed:
            assert self.changed.wait_for(lambda: (interface.read(), condition())[1], WAIT_S), self.states


def take_control(board: LocalBlackBoard, recorder: StatusRecorder) -> Any:
    """Return an agent's instance with control of the Skiller, whose changes ``recorder`` gets."""
    agent = board.open_for_reading(SkillerInterface, "Skiller", owner="agent")
    board.register_listener(recorder, agent, EventKind.DATA_CHANGED)
    agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
    recorder.wait_for(agent, lambda: agent.exclusive_controller == str(agent.serial))
    return agent


@pytest.mark.parametrize("state", share(STATES, 2))
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_run_gets_idle_skiller_and_then_own_skill(transport, state, tmp_path):
    """With an equal skill string, only the id distinguishes the old status from the new status."""
    for last_id in IDS:
        skill = OTHERS_SKILL if last_id % 2 else 'say{text="hello"}'
        with UsedSkiller(state, last_id) as skiller, serve_skiller(skiller, transport, tmp_path) as url:
            check_run_side(skiller, url, skill)


def check_run_side(skiller: UsedSkiller, url: str, skill: str) -> None:
    clock = RealClock()
    bus, registry = EventBus(clock), InterfaceRegistry()
    with LocalBlackBoard(registry, clock) as board:
        remote = RemoteSkiller(url, board, bus, lambda url: open_blackboard(url, registry, clock, bus))
        try:
            recorder = StatusRecorder()
            agent = take_control(board, recorder)
            sent = agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string=skill))
            recorder.wait_for(agent, lambda: (agent.msgid, agent.status) == (sent, agent.S_FINAL))
        finally:
            remote.close()
    assert skiller.executed == [skill]
    own_states = [state for state in recorder.states if state[2] == sent]
    assert own_states[-1] == ("S_FINAL", skill, sent)
    assert own_states[:-1] in ([], [("S_RUNNING", skill, sent)])
    assert [state for state in recorder.states if state not in own_states] in ([], [("S_INACTIVE", "", 0)])


def wait_free(board) -> None:
    """Wait until the interface on ``board`` shows no controller."""
    with board.open_for_reading(SkillerInterface, "Skiller") as reader:
        while reader.read() or reader.exclusive_controller:
            time.sleep(0.002)


@pytest.mark.parametrize("state", share(STATES, 2))
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_skill_call_waits_for_own_skill(transport, state, tmp_path):
    clock = RealClock()
    states: list[tuple[str, str]] = []
    for last_id in IDS:
        with (
            UsedSkiller(state, last_id) as skiller,
            serve_skiller(skiller, transport, tmp_path) as url,
            open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)) as board,
        ):
            for _ in range(2):  # the second call follows an equal call
                states.clear()
                with SkillerCall(board, on_status=lambda *state: states.append(state)) as call:
                    assert call.execute(OTHERS_SKILL, WAIT_S).outcome is CallOutcome.FINAL
                assert states in ([("S_RUNNING", ""), ("S_FINAL", "")], [("S_FINAL", "")])
                wait_free(board)
            assert skiller.executed == [OTHERS_SKILL] * 2


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_control_of_killed_run_is_released(transport, tmp_path):
    """The Skiller knows the serial of the run, but has to notice the death of the run."""
    clock = RealClock()
    with UsedSkiller("final", 2) as skiller, serve_skiller(skiller, transport, tmp_path) as url:
        board = LocalBlackBoard(InterfaceRegistry(), clock)
        bus = EventBus(clock)
        connections = []

        def connect(url):
            connections.append(open_blackboard(url, InterfaceRegistry(), clock, bus))
            return connections[-1]

        RemoteSkiller(url, board, bus, connect)
        take_control(board, StatusRecorder())
        connections[0].shutdown()  # no message, as after the death of the process
        with (
            open_blackboard(url, InterfaceRegistry(), clock, bus) as board_of_call,
            SkillerCall(board_of_call) as call,
        ):
            while call.execute(OTHERS_SKILL, WAIT_S).outcome is not CallOutcome.FINAL:
                pass


def test_run_steals_control_of_foreign_client(tmp_path):
    controller = str(uuid4())
    with (
        UsedSkiller("running", 2, controller=controller) as skiller,
        serve_skiller(skiller, "fawkes", tmp_path) as url,
    ):
        scenario = write_scenario(tmp_path / "s")
        options = RunOptions(scenario=scenario, skiller=url, clock="real", timeout=WAIT_S)
        result = run_scenario(options)
        assert (result.status, skiller.executed) == (0, ['say{text="hello", wait=true}'])


@pytest.mark.parametrize("same_skill", [False, True])
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_run_fails_on_stolen_control(transport, same_skill, tmp_path):
    """A thief of control may send a message with the same id, and even with the same skill."""
    skill_string = OTHERS_SKILL if same_skill else 'say{text="hello"}'
    scenario = write_scenario(tmp_path / "s", mapping=f"act: {skill_string}")
    thief = str(uuid4())
    log = tmp_path / "run.log"
    with UsedSkiller("final", 2, thief=thief) as skiller, serve_skiller(skiller, transport, tmp_path) as url:
        options = RunOptions(scenario=scenario, skiller=url, clock="real", timeout=WAIT_S, log=log)
        result = run_scenario(options)
    assert skiller.executed == [skill_string]
    assert [goal.outcome for goal in result.goals] == ["FAILED"]
    lines = log.read_text()
    assert f"Lost exclusive control of Skiller to {thief}, assuming failure" in lines
    assert f"Execution of act FAILED (Lost exclusive control of Skiller to {thief})" in lines


@pytest.mark.parametrize("same_skill", [False, True])
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_skill_call_fails_on_stolen_control(transport, same_skill, tmp_path):
    clock = RealClock()
    skill_string = OTHERS_SKILL if same_skill else 'say{text="hello"}'
    thief = str(uuid4())
    with (
        UsedSkiller("never used", 0, thief=thief) as skiller,
        serve_skiller(skiller, transport, tmp_path) as url,
        open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)) as board,
        SkillerCall(board) as call,
    ):
        result = call.execute(skill_string, WAIT_S)
    assert skiller.executed == [skill_string]
    assert result.outcome is CallOutcome.FAILED
    assert result.error == f"control of the Skiller was lost to {thief}"
