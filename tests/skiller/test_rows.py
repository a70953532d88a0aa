"""Rows of sections 1 to 3 that test_skiller.py does not have: docs/evidence/skiller-facts.md."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any
from uuid import UUID

from cxbridge.blackboard import EventKind, Listener
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.events import Level
from cxbridge.interfaces import InterfaceRegistry
from tests.skiller.rig import Rig
from tests.skiller.test_skiller import lua, rig, skills, take_control

__all__ = ["lua", "rig", "skills"]  # fixtures


# -- section 1: interfaces


# -- section 2: exclusive control


def test_messages_are_processed_in_order_all_in_one_loop(rig: Rig):
    other = rig.reader()
    rig.send("AcquireControl")
    rig.send("ExecSkill", "count{}")
    rig.send("ExecSkill", "fail{}", by=other)  # dropped: not the controller
    rig.send("ReleaseControl")
    rig.send("AcquireControl", by=other)
    rig.loop()
    assert rig.writes("skill_string", "exclusive_controller") == [("count{}", str(other.serial))]


def test_the_controller_is_the_source_of_a_message_not_its_last_sender(rig: Rig):
    """A proxy passes messages on with a serial of its own: the source stays who sent it first."""
    source, proxy = UUID(int=5, version=4), rig.reader()
    message = proxy.AcquireControlMessage()
    message.address(0, 0, proxy.serial, source)
    proxy.msgq_enqueue(message, proxy=True)
    rig.loop()
    assert rig.state.exclusive_controller == str(source)


def test_control_ends_when_the_controllers_connection_does(rig: Rig, tmp_path: Path):
    gone = threading.Event()

    class Watch(Listener):
        def reader_removed(self, interface: Any, serial: UUID) -> None:
            gone.set()

    with ZmqBlackBoardServer(rig.board, [f"ipc://{tmp_path}/board"]) as server:
        client = ZmqBlackBoard(server.endpoints[0], InterfaceRegistry(), RealClock())
        controller: Any = client.open_for_reading("SkillerInterface", "Skiller", owner="remote")
        arrived = threading.Event()

        class Note(Listener):
            def data_refreshed(self, interface: Any) -> None:
                arrived.set()

        client.register_listener(Note(), controller, EventKind.DATA_REFRESHED)
        controller.msgq_enqueue(controller.AcquireControlMessage())
        for _ in range(2000):
            rig.loop()
            if rig.state.exclusive_controller or arrived.wait(0.01):
                break
        assert rig.state.exclusive_controller == str(controller.serial)
        rig.send("ExecSkill", "count{to=9}", by=rig.reader())
        rig.board.register_listener(Watch(), rig.commander, EventKind.READER_REMOVED)
        client.shutdown()
        assert gone.wait(20)
    rig.loop()
    assert rig.state.exclusive_controller == ""


def test_a_skiller_that_is_loaded_again_runs_nothing_and_has_no_controller(skills: Path, rig: Rig):
    """A Fawkes shows what was shown before: nobody ends the skill, and the controller may be gone."""
    take_control(rig)
    rig.exec("count{to=1000}")
    assert rig.status == "S_RUNNING"
    rig.backends.pop().close()
    assert (rig.status, rig.state.exclusive_controller) == ("S_FAILED", "")
    rig.lua([skills], space="space")
    rig.loop()
    assert (rig.status, rig.state.exclusive_controller) == ("S_FAILED", "")
    take_control(rig)
    rig.exec("count{}")
    assert rig.status == "S_RUNNING"


# -- section 3: execution and status


def test_all_of_several_exec_are_compiled(rig: Rig):
    rig.send("ExecSkill", "count{")
    rig.send("ExecSkill", "count{}")
    rig.loop()
    assert rig.logged(Level.ERROR)[0].startswith("Failed to compile skill string: count{|")
    assert rig.writes("skill_string", "status") == [("count{}", "S_RUNNING")]
    rig.send("ExecSkill", "count{}")
    rig.send("ExecSkill", "count{")
    rig.loop(3)
    assert (rig.state.skill_string, rig.status) == ("count{", "S_FAILED")


def test_the_whole_chunk_is_called_every_loop_in_one_sandbox(lua: Rig):
    rig = lua
    rig.exec('n = (n or 0) + 1; print_info("loop %d", n); count{}', loops=5)
    assert [text for text in rig.logged(Level.INFO) if text.startswith("loop")] == [
        "loop 1",
        "loop 2",
        "loop 3",
    ]


def test_each_skill_string_gets_a_new_sandbox(lua: Rig):
    rig = lua
    rig.exec("mine = 1")
    rig.forget()
    rig.exec("print_info(tostring(mine))")
    assert rig.logged(Level.INFO)[-1] == "nil"


def test_the_error_is_that_of_the_failed_skill(rig: Rig):
    """Fawkes shows that of the first executed one, here none."""
    rig.exec('count{} fail{why="x"}')
    assert (rig.status, rig.state.error) == ("S_FAILED", "on purpose")


def test_the_error_of_an_earlier_skill_string_goes_with_the_next_one(rig: Rig):
    """Fawkes keeps it until the status changes."""
    rig.exec('fail{why="x"}', loops=2)
    rig.exec("count{}")
    assert rig.state.error == ""


def test_a_lua_error_resets_the_skills_and_stops(lua: Rig):
    rig = lua
    rig.exec('count{} error("x")', loops=3)
    assert len([text for text in rig.logged(Level.ERROR) if "Failed to execute" in text]) == 1
    assert "leave COUNT" in rig.logged(Level.DEBUG)
    assert not rig.backends[0].running
