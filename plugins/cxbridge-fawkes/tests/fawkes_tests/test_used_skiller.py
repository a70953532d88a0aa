"""A Skiller with earlier clients: only its state for our message counts as its answer.

All senders count their messages from the same number, so the last message of another client may have had the
id of ours: its old status was taken for ours, and the first skill of a run was reported final without having
been executed.
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
"""Ids of the last message: all that the first messages of another sender may get, and where counting ends."""

TRANSPORTS = ("zmq", "fawkes", "gateway")
"""The Skiller is elsewhere in each; one in the same process is as new as the run."""


@contextmanager
def reach(skiller: UsedSkiller, transport: str, folder) -> Iterator[str]:
    """Serve the Skiller's blackboard; give the URL."""
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


class Seen(Listener):
    """What an executive's interface showed, in the order it was written."""

    def __init__(self) -> None:
        self.states: list[tuple[str, str, int]] = []
        self.news = threading.Condition()

    def data_changed(self, interface) -> None:
        interface.read()
        with self.news:
            state = (interface.status.name, interface.skill_string, interface.msgid)
            if state not in self.states[-1:]:
                self.states.append(state)
            self.news.notify_all()

    def wait_for(self, interface, condition) -> None:
        with self.news:
            assert self.news.wait_for(lambda: (interface.read(), condition())[1], WAIT_S), self.states


def take_control(board: LocalBlackBoard, seen: Seen) -> Any:
    """Return an agent's instance that has control of the Skiller, and whose changes ``seen`` hears."""
    agent = board.open_for_reading(SkillerInterface, "Skiller", owner="agent")
    board.register_listener(seen, agent, EventKind.DATA_CHANGED)
    agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
    seen.wait_for(agent, lambda: agent.exclusive_controller == str(agent.serial))
    return agent


@pytest.mark.parametrize("state", share(STATES, 2))
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_a_run_sees_an_idle_skiller_and_then_its_own_skill(transport, state, tmp_path):
    """With the same skill again, only the id tells the status before from the status after."""
    for last_id in IDS:
        skill = OTHERS_SKILL if last_id % 2 else 'say{text="hello"}'
        with UsedSkiller(state, last_id) as skiller, reach(skiller, transport, tmp_path) as url:
            check_run_side(skiller, url, skill)


def check_run_side(skiller: UsedSkiller, url: str, skill: str) -> None:
    clock = RealClock()
    bus, registry = EventBus(clock), InterfaceRegistry()
    with LocalBlackBoard(registry, clock) as board:
        remote = RemoteSkiller(url, board, bus, lambda url: open_blackboard(url, registry, clock, bus))
        try:
            seen = Seen()
            agent = take_control(board, seen)
            sent = agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string=skill))
            seen.wait_for(agent, lambda: (agent.msgid, agent.status) == (sent, agent.S_FINAL))
        finally:
            remote.close()
    assert skiller.executed == [skill]
    ours = [state for state in seen.states if state[2] == sent]
    assert ours[-1] == ("S_FINAL", skill, sent)
    assert ours[:-1] in ([], [("S_RUNNING", skill, sent)])
    assert [state for state in seen.states if state not in ours] in ([], [("S_INACTIVE", "", 0)])


def wait_free(board) -> None:
    """Wait until no client has control, as far as this board shows."""
    with board.open_for_reading(SkillerInterface, "Skiller") as reader:
        while reader.read() or reader.exclusive_controller:
            time.sleep(0.002)


@pytest.mark.parametrize("state", share(STATES, 2))
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_a_skill_call_waits_for_its_own_skill(transport, state, tmp_path):
    clock = RealClock()
    told: list[tuple[str, str]] = []
    for last_id in IDS:
        with (
            UsedSkiller(state, last_id) as skiller,
            reach(skiller, transport, tmp_path) as url,
            open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)) as board,
        ):
            for _ in range(2):  # the second follows its own like
                told.clear()
                with SkillerCall(board, on_status=lambda *state: told.append(state)) as call:
                    assert call.execute(OTHERS_SKILL, WAIT_S).outcome is CallOutcome.FINAL
                assert told in ([("S_RUNNING", ""), ("S_FINAL", "")], [("S_FINAL", "")])
                wait_free(board)
            assert skiller.executed == [OTHERS_SKILL] * 2


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_control_of_a_run_that_was_killed_is_free(transport, tmp_path):
    """It stayed with the dead run: the Skiller knew its serial, but not that it was gone."""
    clock = RealClock()
    with UsedSkiller("final", 2) as skiller, reach(skiller, transport, tmp_path) as url:
        board = LocalBlackBoard(InterfaceRegistry(), clock)
        bus = EventBus(clock)
        links = []

        def connect(url):
            links.append(open_blackboard(url, InterfaceRegistry(), clock, bus))
            return links[-1]

        RemoteSkiller(url, board, bus, connect)
        take_control(board, Seen())
        links[0].shutdown()  # as when the process dies: nothing is said
        with open_blackboard(url, InterfaceRegistry(), clock, bus) as other, SkillerCall(other) as call:
            while call.execute(OTHERS_SKILL, WAIT_S).outcome is not CallOutcome.FINAL:
                pass


def test_a_run_steals_control_that_somebody_has(tmp_path):
    somebody = str(uuid4())
    with (
        UsedSkiller("running", 2, controller=somebody) as skiller,
        reach(skiller, "fawkes", tmp_path) as url,
    ):
        scenario = write_scenario(tmp_path / "s")
        options = RunOptions(scenario=scenario, skiller=url, clock="real", timeout=WAIT_S)
        result = run_scenario(options)
        assert (result.status, skiller.executed) == (0, ['say{text="hello", wait=true}'])


@pytest.mark.parametrize("same_skill", [False, True])
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_a_run_does_not_take_the_status_of_a_thief_for_its_own(transport, same_skill, tmp_path):
    """Who steals control in mid-skill may get the id of our message, and even ask for the same skill."""
    ours = OTHERS_SKILL if same_skill else 'say{text="hello"}'
    scenario = write_scenario(tmp_path / "s", mapping=f"act: {ours}")
    thief = str(uuid4())
    log = tmp_path / "run.log"
    with UsedSkiller("final", 2, thief=thief) as skiller, reach(skiller, transport, tmp_path) as url:
        options = RunOptions(scenario=scenario, skiller=url, clock="real", timeout=WAIT_S, log=log)
        result = run_scenario(options)
    assert skiller.executed == [ours]
    assert [goal.outcome for goal in result.goals] == ["FAILED"]
    lines = log.read_text()
    assert f"Lost exclusive control of Skiller to {thief}, assuming failure" in lines
    assert f"Execution of act FAILED (Lost exclusive control of Skiller to {thief})" in lines


@pytest.mark.parametrize("same_skill", [False, True])
@pytest.mark.parametrize("transport", TRANSPORTS)
def test_a_skill_call_does_not_take_the_status_of_a_thief_for_its_own(transport, same_skill, tmp_path):
    clock = RealClock()
    ours = OTHERS_SKILL if same_skill else 'say{text="hello"}'
    thief = str(uuid4())
    with (
        UsedSkiller("never used", 0, thief=thief) as skiller,
        reach(skiller, transport, tmp_path) as url,
        open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)) as board,
        SkillerCall(board) as call,
    ):
        result = call.execute(ours, WAIT_S)
    assert skiller.executed == [ours]
    assert result.outcome is CallOutcome.FAILED
    assert result.error == f"control of the Skiller was lost to {thief}"
