"""The service of a skill board: the loop of a command, and the configuration."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import BoardSettings
from cxbridge.skiller.status import Status

EXECUTORS = """
from cxbridge.skiller.board import SkillExecutor

class Wave(SkillExecutor):
    skills = ("wave",)
    known_settings = ("times", "hands", "fast", "how")

    def execute(self, call):
        for done in range(self.setting("times", 1)):
            yield done

class Skilless(SkillExecutor):
    def execute(self, call):
        yield

class Clumsy(Wave):
    def start(self):
        raise OSError("no arm")
"""
BASE = """
skill-board:
  agents:
    r1:
      executors:
        wave:
          class: executors.py:Wave
"""


@pytest.fixture
def service(tmp_path):
    services = []

    def make(text):
        (tmp_path / "executors.py").write_text(EXECUTORS)
        config = Configuration.from_text(text, str(tmp_path / "scenario.yaml"))
        settings = BoardSettings.from_config(config, tmp_path)
        assert settings is not None
        clock = VirtualClock()
        board = LocalBlackBoard(InterfaceRegistry(), clock)
        services.append((SkillBoardService(board, clock, EventBus(clock), settings), board))
        return services[-1][0], board

    yield make
    for service, board in services:
        service.close()
        assert board.list_all() == []


def test_command_is_executed_in_loop_of_reading(service):
    skill_board, board = service(BASE)
    with board.open_for_reading("SkillerInterface", "r1", owner="agent") as reader:
        message = reader.create_message("ExecSkillMessage")
        message.set("skill_string", "wave{}")
        reader.msgq_enqueue(message)
        skill_board.loop()
        reader.read()
        assert reader.status == Status.S_RUNNING
        assert skill_board.hosts[0].state == "BUSY"
        assert skill_board.running
        skill_board.loop()
        reader.read()
        assert reader.status == Status.S_FINAL
        assert not skill_board.running


def test_settings_have_types_of_configuration(service):
    skill_board, _ = service(
        BASE + "          times: 3\n          hands: [left, right]\n          fast: on\n          how: 0.5\n"
    )
    assert skill_board.hosts[0].executor.settings == {
        "times": 3,
        "hands": ["left", "right"],
        "fast": True,
        "how": 0.5,
    }
    assert skill_board.hosts[0].name == "r1-wave"


def test_service_without_local_executors(service):
    skill_board, _ = service(BASE + "  in-process: false\n")
    assert skill_board.hosts == []


def test_configuration_without_section_has_no_skill_board():
    assert BoardSettings.from_config(Configuration(), Path()) is None


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("skill-board: {agents: {r1: {}}, timeout: {start: 1}}", "/skill-board/timeout is not a setting", 1),
        (
            "skill-board: {agents: {r1: {}}, timeouts: {begin: 1}}",
            "/skill-board/timeouts/begin is not a setting",
            1,
        ),
        ("skill-board: {agents: {r1: {}}, timeouts: {start: 0}}", "must be above 0", 1),
        (
            "skill-board:\n  agents: {r1: {skillers: x}}",
            "/skill-board/agents/r1/skillers is not a setting",
            2,
        ),
        ("skill-board: {name: x}", "has no agents", 1),
        (BASE.replace("Wave", "Vawe"), "has no executor 'Vawe'", 7),
        (BASE.replace("executors.py:", "other.py:"), "there is no such file", None),
        (BASE.replace("executors.py:", "no.such.module:"), "no Python module 'no.such.module'", 7),
        (BASE.replace("executors.py:Wave", "Wave"), "is not the name of an executor class", 7),
        (BASE.replace("Wave", "Skilless"), "has no skills", 7),
        (BASE + "          arms: 3\n", "has no setting 'arms'", 7),
        (BASE.replace("Wave", "Clumsy"), "Clumsy does not start: OSError: no arm", 7),
        (f"skill-board: {{agents: {{{'x' * 65}: {{skiller: s}}}}}}", "an agent cannot be called", 1),
    ],
)
def test_configuration_errors_have_line(service, text, message, line):
    with pytest.raises(CxbridgeError, match=message) as raised:
        service(text)
    assert raised.value.line == line


@pytest.mark.parametrize(
    ("source", "line"), [("import nothing_like_this\n", 1), ("x = 1\ndef f(:\n", 2), ("\n\n1 / 0\n", 3)]
)
def test_broken_executor_file_is_error_with_line(service, tmp_path, source, line):
    (tmp_path / "broken.py").write_text(source)
    with pytest.raises(CxbridgeError, match="does not load") as raised:
        service(BASE.replace("executors.py:", "broken.py:"))
    assert (raised.value.file, raised.value.line) == (str(tmp_path / "broken.py"), line)


def test_failed_service_leaves_no_interfaces(tmp_path):
    (tmp_path / "executors.py").write_text(EXECUTORS)
    clock = VirtualClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock)
    text = BASE + "        other: {class: 'executors.py:Nobody'}\n"
    settings = BoardSettings.from_config(Configuration.from_text(text), tmp_path)
    assert settings is not None
    with pytest.raises(CxbridgeError, match="Nobody"):
        SkillBoardService(board, clock, EventBus(clock), settings)
    assert board.list_all() == []
