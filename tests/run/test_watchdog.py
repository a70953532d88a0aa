"""A loop without an end: notifications, and the interrupt."""

from __future__ import annotations

import json
import os
import signal
import socket
import threading
import time
from contextlib import contextmanager

import pytest

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.clock import RealClock, VirtualClock
from cxbridge.daemon.client import read_status, send_command
from cxbridge.daemon.options import DaemonOptions
from cxbridge.events import EventBus, LogLine
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.mainloop import Hook, MainLoop
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.run.watchdog import Stall, Watchdog
from tests.daemon.test_daemon import WAIT_S, connected, running, start, until
from tests.daemon.test_rights import rest
from tests.run.mini import write_scenario, write_skill_space
from tests.skiller.rig import Rig
from tests.support import needs_plugin

SPIN = """
(defrule arm (executive-initialized) (time ? ?) (not (go)) => (assert (go)))
(defrule spin (go) => (while TRUE (bind ?x 1)))
"""
LIMIT_S = 0.3


class World:
    """An environment in a loop of its own thread, watched."""

    def __init__(self, constructs):
        self.lines: list[str] = []
        bus = EventBus(VirtualClock())
        bus.subscribe(self.note, LogLine)
        self.env = ClipsEnvironment("world", bus)
        self.env.define("sleep-for", time.sleep, 1)
        for construct in constructs:
            self.env.build(construct)
        self.env.assert_string("(x)")
        self.stalls: list[Stall] = []
        self.heard = threading.Event()
        self.over = threading.Event()
        self.loop = MainLoop(RealClock(), 10_000)
        self.loop.add(Hook.THINK, self.env.run)
        self.watchdog = Watchdog(self.loop, lambda: {"world": self.env}, self.take, LIMIT_S)
        self.thread = threading.Thread(target=self.work)

    def note(self, event):
        self.lines.append(event.text)

    def take(self, stall):
        if stall is None:
            self.over.set()
        else:
            self.stalls.append(stall)
            self.heard.set()

    def work(self):
        self.watchdog.start()
        self.loop.run(lambda: False)


@contextmanager
def watched(*constructs):
    world = World(constructs)
    world.thread.start()
    try:
        yield world
    finally:
        world.loop.stop()
        while world.thread.is_alive():
            world.watchdog.interrupt()
            world.thread.join(0.2)
        world.watchdog.stop()
        world.env.destroy()


@pytest.mark.parametrize(
    ("constructs", "activity"),
    [
        (["(defrule a (x) => (while TRUE (bind ?y 1)))", "(defrule b (x) =>)"], "rule a does not end"),
        (["(defrule a (x) => (sleep-for 1.5))"], "function sleep-for, which rule a has called, does not end"),
    ],
)
def test_stall_names_rule_or_function(constructs, activity):
    with watched(*constructs) as world:
        assert world.heard.wait(WAIT_S)
        assert world.stalls[0].activity.startswith(activity)
        assert world.stalls[0].is_in_rules == ("sleep-for" not in activity)


def test_stall_is_reported_again_after_double_duration():
    with watched("(defrule a (x) => (while TRUE (bind ?y 1)))") as world:
        assert until(lambda: len(world.stalls) > 1)
    first_s, second_s = (stall.seconds for stall in world.stalls[:2])
    assert 2 * first_s <= second_s


def test_stall_between_rules_names_location():
    """Between two rules, the environment still counts as firing."""
    with watched() as world:
        world.loop.add(Hook.THINK, lambda: vars(world.env).update(is_firing=True))
        world.loop.add(Hook.THINK, lambda: world.heard.wait(WAIT_S))
        assert world.heard.wait(WAIT_S)
    assert [(stall.activity[:11], stall.is_spin) for stall in world.stalls[:1]] == [("a loop does", False)]


def test_loop_continues_after_interrupted_rule():
    with watched(
        "(defrule a (x) => (while TRUE (bind ?y 1)))", "(defrule b (z) => (assert (done)))"
    ) as world:
        assert world.heard.wait(WAIT_S)
        world.watchdog.interrupt()
        assert world.over.wait(WAIT_S)
        before = world.loop.cycle_count
        assert until(lambda: world.loop.cycle_count > before + 1)
        assert not world.env.is_ended
        world.loop.stop()
        world.thread.join(WAIT_S)
        world.env.assert_string("(z)")
        assert world.env.run() == 1


# -- a daemon


def spinning(tmp_path, **more):
    scenario = write_scenario(tmp_path / "s", agent=SPIN)
    settings = {
        "fawkes/enable": False,
        "zmq/endpoints": [f"ipc://{tmp_path}/bb"],
        **more,
    }
    return running(DaemonOptions(config=scenario, settings=tuple(settings.items())))


def wait_for(board, state):
    deadline_s = time.monotonic() + WAIT_S
    while (status := read_status(board))["state"] != state or (
        state == "DEGRADED" and "rule spin" not in status["error"]
    ):
        assert time.monotonic() < deadline_s, status
        time.sleep(0.05)
    return status


def test_endless_rule_degrades_daemon_until_interrupt(tmp_path):
    with spinning(tmp_path) as (daemon, lines, outcome), connected(daemon) as board:
        status = wait_for(board, "DEGRADED")
        reasons = {part["name"]: part["reason"] for part in status["components"]}
        assert "rule spin does not end" in reasons["executive"]
        assert status["error"].startswith("executive: rule spin does not end")
        assert send_command(board, "Interrupt", WAIT_S)
        assert wait_for(board, "RUNNING")["error"] == ""
        assert any("executive: rule spin does not end" in line for line in lines)
    assert outcome == [0]


@pytest.mark.parametrize("command", ["Pause", "Reset", "Shutdown"])
def test_commands_reach_daemon_with_endless_rule(tmp_path, command):
    with spinning(tmp_path) as (daemon, _, outcome), connected(daemon) as board:
        wait_for(board, "DEGRADED")
        assert send_command(board, command, WAIT_S)
        if command != "Shutdown":
            daemon.stalls.interrupt()  # the rule may spin again
            assert send_command(board, "Pause", WAIT_S)
    assert outcome == [0]


def test_interrupt_needs_remote_control(tmp_path):
    with spinning(tmp_path, **{"remote-control": False}) as (daemon, lines, _), connected(daemon) as board:
        wait_for(board, "DEGRADED")
        with pytest.raises(BlackBoardError, match="remote-control of the daemon is off"):
            send_command(board, "Interrupt", 1.0)
        assert read_status(board)["state"] == "DEGRADED"
        daemon.stop()
        daemon.stalls.watchdog.interrupt()
    assert not any("asks to interrupt" in line for line in lines)


def ask_over_http(daemon, method, path):
    status, text = rest(daemon, method, path)
    return status, json.loads(text)


@needs_plugin("web")
def test_rest_api_answers_during_endless_rule(tmp_path):
    with spinning(tmp_path, **{"web/port": 0}) as (daemon, _, outcome), connected(daemon) as board:
        wait_for(board, "DEGRADED")
        code, health = ask_over_http(daemon, "GET", "/cxbridge/health")
        assert (code, health["state"]) == (503, "DEGRADED")
        assert "rule spin does not end" in health["error"]
        code, status = ask_over_http(daemon, "GET", "/cxbridge/status")
        assert (code, status["state"], status["environments"]) == (200, "DEGRADED", [])
        assert "rule spin does not end" in status["stalled"]
        assert ask_over_http(daemon, "POST", "/cxbridge/interrupt")[0] == 200
        wait_for(board, "RUNNING")
        code, health = ask_over_http(daemon, "GET", "/cxbridge/health")
        assert (code, health["state"], health["error"]) == (200, "RUNNING", "")
        assert ask_over_http(daemon, "GET", "/cxbridge/status")[1]["stalled"] == ""
    assert outcome == [0]


def listener_says(listener, wanted):
    while listener.recv(4096) != wanted:
        pass


def test_endless_rule_stops_watchdog_of_systemd(tmp_path):
    scenario = write_scenario(tmp_path / "s", agent=SPIN)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(WAIT_S)
        env = {**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify")}
        process, _ = start(tmp_path, str(scenario), env=env)
        said = ""
        while "rule spin does not end" not in said:
            said = listener.recv(4096).decode()
        assert said.startswith("STATUS=")
        listener.settimeout(1.5)  # it is fed once a second
        with pytest.raises(TimeoutError):
            listener_says(listener, b"WATCHDOG=1")
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=WAIT_S)
        assert process.returncode == 0, errors


# -- a skill

STUCK = """
function execute()
    local found = ("a"):rep(220):find("^a-a-a-a-b")
    while not found do end
end
function reset() end
"""


def test_skill_string_in_c_function_is_named_and_fails(tmp_path):
    folder = write_skill_space(tmp_path / "lua", "stuck", say=STUCK)
    rig = Rig()
    skiller = rig.lua([folder], space="stuck")
    texts: list[str] = []
    reader = rig.board.open_for_reading("SkillerInterface", "Skiller", owner="test")
    reader.msgq_enqueue(reader.ExecSkillMessage("say{}"))  # type: ignore[attr-defined]
    loop = MainLoop(RealClock(), 10_000)
    loop.add(Hook.SKILL, skiller.loop)
    watchdog = Watchdog(loop, dict, lambda stall: texts.append(str(stall)) if stall else None, LIMIT_S)
    watchdog.start()
    loop.run(lambda: rig.status == "S_FAILED")
    watchdog.stop()
    assert texts
    assert texts[0].startswith("skill say{} does not end")
    assert "endless loop?" in rig.state.error


# -- a run


def test_endless_rule_is_named_and_run_times_out(tmp_path, monkeypatch):
    monkeypatch.setattr("cxbridge.run.watchdog.STALL_S", LIMIT_S)
    monkeypatch.setattr("cxbridge.run.run.MIN_STALL_S", 2 * LIMIT_S)
    scenario = write_scenario(tmp_path / "s", agent=SPIN)
    lines: list[str] = []
    options = RunOptions(scenario=scenario, timeout=0.5)
    result = run_scenario(options, lambda line: lines.append(line.text))  # type: ignore[attr-defined]
    assert result.status == 3
    assert "rule spin does not end" in result.reason
    assert any("rule spin does not end" in line and "Ctrl-C" in line for line in lines)
