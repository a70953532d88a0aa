"""Rows of sections 1 to 3 of docs/evidence/skiller-facts.md without a test in test_skiller.py."""

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


def test_messages_are_processed_in_order_in_single_loop(rig: Rig):
    other = rig.reader()
    rig.send("AcquireControl")
    rig.send("ExecSkill", "count{}")
    rig.send("ExecSkill", "fail{}", by=other)  # dropped: the sender is not the controller
    rig.send("ReleaseControl")
    rig.send("AcquireControl", by=other)
    rig.loop()
    assert rig.writes("skill_string", "exclusive_controller") == [("count{}", str(other.serial))]


def test_controller_is_source_and_not_last_sender_of_message(rig: Rig):
    """A proxy forwards messages with its own serial; the source remains the first sender."""
    source, proxy = UUID(int=5, version=4), rig.reader()
    message = proxy.AcquireControlMessage()
    message.address(0, 0, proxy.serial, source)
    proxy.msgq_enqueue(message, proxy=True)
    rig.loop()
    assert rig.state.exclusive_controller == str(source)


def test_control_ends_with_connection_of_controller(rig: Rig, tmp_path: Path):
    removed = threading.Event()

    class ReaderWatch(Listener):
        def reader_removed(self, interface: Any, serial: UUID) -> None:
            removed.set()

    with ZmqBlackBoardServer(rig.board, [f"ipc://{tmp_path}/board"]) as server:
        client = ZmqBlackBoard(server.endpoints[0], InterfaceRegistry(), RealClock())
        controller: Any = client.open_for_reading("SkillerInterface", "Skiller", owner="remote")
        arrived = threading.Event()

        class DataWatch(Listener):
            def data_refreshed(self, interface: Any) -> None:
                arrived.set()

        client.register_listener(DataWatch(), controller, EventKind.DATA_REFRESHED)
        controller.msgq_enqueue(controller.AcquireControlMessage())
        for _ in range(2000):
            rig.loop()
            if rig.state.exclusive_controller or arrived.wait(0.01):
                break
        assert rig.state.exclusive_controller == str(controller.serial)
        rig.send("ExecSkill", "count{to=9}", by=rig.reader())
        rig.board.register_listener(ReaderWatch(), rig.commander, EventKind.READER_REMOVED)
        client.shutdown()
        assert removed.wait(20)
    rig.loop()
    assert rig.state.exclusive_controller == ""


def test_reloaded_skiller_has_no_skill_and_no_controller(skills: Path, rig: Rig):
    """Fawkes shows the earlier values: no component ends the skill, and the controller may be gone."""
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


def test_all_skill_strings_of_loop_are_compiled(rig: Rig):
    rig.send("ExecSkill", "count{")
    rig.send("ExecSkill", "count{}")
    rig.loop()
    assert rig.logged(Level.ERROR)[0].startswith("Failed to compile skill string: count{|")
    assert rig.writes("skill_string", "status") == [("count{}", "S_RUNNING")]
    rig.send("ExecSkill", "count{}")
    rig.send("ExecSkill", "count{")
    rig.loop(3)
    assert (rig.state.skill_string, rig.status) == ("count{", "S_FAILED")


def test_chunk_is_called_in_each_loop_in_same_sandbox(lua: Rig):
    rig = lua
    rig.exec('n = (n or 0) + 1; print_info("loop %d", n); count{}', loops=5)
    assert [text for text in rig.logged(Level.INFO) if text.startswith("loop")] == [
        "loop 1",
        "loop 2",
        "loop 3",
    ]


def test_each_skill_string_has_new_sandbox(lua: Rig):
    rig = lua
    rig.exec("mine = 1")
    rig.forget()
    rig.exec("print_info(tostring(mine))")
    assert rig.logged(Level.INFO)[-1] == "nil"


def test_error_is_that_of_failed_skill(rig: Rig):
    """Fawkes shows the error of the first executed skill, here none."""
    rig.exec('count{} fail{why="x"}')
    assert (rig.status, rig.state.error) == ("S_FAILED", "on purpose")


def test_new_skill_string_clears_earlier_error(rig: Rig):
    """Fawkes keeps the error until the status changes."""
    rig.exec('fail{why="x"}', loops=2)
    rig.exec("count{}")
    assert rig.state.error == ""


def test_lua_error_resets_skills_and_stops_execution(lua: Rig):
    rig = lua
    rig.exec('count{} error("x")', loops=3)
    assert len([text for text in rig.logged(Level.ERROR) if "Failed to execute" in text]) == 1
    assert "leave COUNT" in rig.logged(Level.DEBUG)
    assert not rig.backends[0].running
