"""The skill board's protocol over ZeroMQ and Fawkes' protocol, with executors in separate processes."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.board.master import Master, Timeouts
from cxbridge.skiller.board.protocol import MasterState
from tests.fawkes import TRANSPORT, fawkes_server
from tests.forked import nursery
from tests.skiller.board.rig import Rig, call, states

WAIT_S = 60
HEARTBEAT_S = 0.2

WAVE = """
from cxbridge.skiller.board import Progress, SkillExecutor, SkillFailedError

class Wave(SkillExecutor):
    skills = ("wave",)
    known_settings = ("times",)

    def execute(self, call):
        for done in range(int(call.number("times", self.setting("times", 3)))):
            yield Progress(done, "waving")
        if call.get("fail", False):
            raise SkillFailedError("my arm hurts")
"""


class RealRig(Rig):
    """A rig in real time."""

    def until(self, condition: Callable[[], bool], loops: int = 0) -> None:
        end_s = time.monotonic() + WAIT_S
        while not condition():
            assert time.monotonic() < end_s, self.lines[-20:]
            for board in self.boards:
                board.loop()
            for host in self.hosts:
                host.loop()
            self.clock.sleep_until(self.clock.now_us() + 2_000)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ZmqBlackBoardServer]:
    board = LocalBlackBoard(InterfaceRegistry(), RealClock())
    with ZmqBlackBoardServer(board, [f"ipc://{tmp_path}/board"], heartbeat=HEARTBEAT_S) as server:
        yield server


def client(server: ZmqBlackBoardServer) -> ZmqBlackBoard:
    return ZmqBlackBoard(server.endpoints[0], InterfaceRegistry(), RealClock())


@pytest.fixture(params=["board here", "board in a client", *TRANSPORT])
def rigs(request: pytest.FixtureRequest, server: ZmqBlackBoardServer) -> Iterator[tuple[RealRig, RealRig]]:
    """Yield a rig with the board, and a rig with executors in another client."""
    with ExitStack() as stack:
        board_rig = RealRig(client(server) if "a client" in request.param else server.board, RealClock())
        stack.callback(board_rig.close)
        if request.param == "fawkes":
            fawkes = stack.enter_context(fawkes_server(server.board))
            url = f"fawkes://127.0.0.1:{fawkes.port}"
            board = open_blackboard(url, InterfaceRegistry(), RealClock())
        else:
            board = client(server)
        executor_rig = RealRig(board, RealClock())
        stack.callback(executor_rig.close)
        yield board_rig, executor_rig


def loop_both(rigs: tuple[RealRig, RealRig], condition: Callable[[], bool]) -> None:
    """Loop both rigs until the condition holds."""

    def check() -> bool:
        for host in rigs[1].hosts:
            host.loop()
        return condition()

    rigs[0].until(check)


def test_lost_connection_of_executor_fails_its_action_only(rigs):
    skills, _puppet = rigs[0].skills(), rigs[1].puppet("r1", "e1")
    local_executor = rigs[0].puppet("r1", "e2")
    masters = [skills.request(call()), skills.request(call())]
    loop_both(rigs, lambda: states(*masters) == ["RUNNING", "RUNNING"])
    rigs[1].hosts.clear()
    rigs[1].board.shutdown()
    loop_both(rigs, lambda: any(master.is_over for master in masters))
    assert sorted(states(*masters)) == ["FAILED", "RUNNING"]
    lost = next(master for master in masters if master.is_over)
    assert lost.error == "the executor e1 is gone"
    assert local_executor.cleaned == 0


# -- processes


class Process:
    """An executor in a separate process: ``cxbridge skill executor``."""

    def __init__(self, folder: Path, url: str, agent: str, *arguments: str) -> None:
        (folder / "wave.py").write_text(WAVE)
        command = ["skill", "executor", f"{folder}/wave.py:Wave", "--agent", agent, "--connect", url]
        self._forked = nursery().begin([*command, *arguments])

    def signal(self, number: int) -> None:
        os.kill(self._forked.process.number, number)

    def end(self) -> tuple[int, str]:
        """Return the exit status and the log."""
        log = self._forked.stderr.read().decode()
        return self._forked.process.wait(WAIT_S), log

    def close(self) -> None:
        """Kill the process if it still runs."""
        forked = self._forked
        with forked.process, forked.stdin, forked.stdout, forked.stderr:
            forked.process.kill()
            forked.process.wait(WAIT_S)


@pytest.fixture
def processes() -> Iterator[list[Process]]:
    processes: list[Process] = []
    yield processes
    for process in processes:
        process.close()


def have_arrived(rig: Rig, board: int, *names: str) -> Callable[[], bool]:
    return lambda: {info.id for info in rig.boards[board].executors} >= set(names)


@pytest.fixture
def rig(server: ZmqBlackBoardServer) -> Iterator[RealRig]:
    rig = RealRig(server.board, RealClock())
    yield rig
    rig.close()


def test_process_executes_and_ends_at_sigterm(rig, server, tmp_path, processes):
    skills = rig.skills()
    processes.append(Process(tmp_path, server.endpoints[0], "r1"))
    rig.until(have_arrived(rig, 0, "r1-wave"))
    done, failed = skills.request(call("wave")), skills.request(call("wave", fail=True))
    rig.until(lambda: done.is_over and failed.is_over)
    assert states(done, failed) == ["SUCCEEDED", "FAILED"]
    assert failed.error == "my arm hurts"
    running = skills.request(call("wave", times=10**6))
    rig.until(lambda: running.state is MasterState.RUNNING)
    processes[0].signal(signal.SIGTERM)
    rig.until(lambda: running.is_over)
    assert running.error == "the executor r1-wave was shut down"
    status, log = processes[0].end()
    assert status == 0
    assert "Ready: r1-wave executes wave for r1" in log


def test_kill_9_fails_own_action_and_successor_takes_over(rig, server, tmp_path, processes):
    skills = rig.skills()
    processes += [Process(tmp_path, server.endpoints[0], agent) for agent in ("r1", "r2")]
    rig.until(have_arrived(rig, 0, "r1-wave", "r2-wave"))
    masters = [skills.request(call("wave", agent, times=10**6)) for agent in ("r1", "r2")]
    rig.until(lambda: states(*masters) == ["RUNNING", "RUNNING"])
    processes[0].signal(signal.SIGKILL)
    processes.append(
        Process(tmp_path, server.endpoints[0], "r1")
    )  # while the server still knows the dead process
    rig.until(lambda: masters[0].is_over)
    assert states(*masters) == ["FAILED", "RUNNING"]
    assert masters[0].error == "the executor r1-wave is gone"
    rig.until(have_arrived(rig, 0, "r1-wave"))
    repeated = skills.request(call("wave"))
    rig.until(lambda: repeated.is_over)
    assert states(repeated, masters[1]) == ["SUCCEEDED", "RUNNING"]


def test_frozen_process_delays_no_action_and_is_cancelled_later(rig, server, tmp_path, processes):
    skills = rig.skills(timeouts=Timeouts(silence=1.5))
    processes += [Process(tmp_path, server.endpoints[0], agent) for agent in ("r1", "r2")]
    rig.until(have_arrived(rig, 0, "r1-wave", "r2-wave"))
    frozen = skills.request(call("wave", "r1", times=10**6))
    rig.until(lambda: frozen.state is MasterState.RUNNING)
    processes[0].signal(signal.SIGSTOP)
    r2_calls: list[Master] = []
    for _ in range(3):
        r2_calls.append(skills.request(call("wave", "r2")))
        rig.until(lambda: r2_calls[-1].is_over)
    assert set(states(*r2_calls)) == {"SUCCEEDED"}
    rig.until(lambda: frozen.is_over)
    assert states(frozen) == ["FAILED"]
    processes[0].signal(signal.SIGCONT)
    repeated = skills.request(call("wave", "r1"))
    rig.until(lambda: repeated.is_over)
    if repeated.state is MasterState.FAILED:  # the request preceded the return of the process, or its end
        rig.until(have_arrived(rig, 0, "r1-wave"))
        repeated = skills.request(call("wave", "r1"))
        rig.until(lambda: repeated.is_over)
    assert states(repeated) == ["SUCCEEDED"]


def test_second_process_with_same_id_is_refused(rig, server, tmp_path, processes, monkeypatch):
    rig.skills()
    processes.append(Process(tmp_path, server.endpoints[0], "r1"))
    rig.until(have_arrived(rig, 0, "r1-wave"))
    processes.append(Process(tmp_path, server.endpoints[0], "r1"))
    status, log = processes[1].end()
    assert status == 2
    assert "There is already a writer on interface 'r1-wave'" in log
    assert "Traceback" not in log
