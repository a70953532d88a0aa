"""The commands `cxbridge skill executor` and `cxbridge skill board`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.commands import skill
from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock
from cxbridge.daemon.services.executor import run_executor
from cxbridge.daemon.services.options import ExecutorOptions
from cxbridge.skiller.board import ExecutorContext, SkillExecutor
from cxbridge.skiller.board.host import ExecutorHost
from tests.cli.boards import SharedBoard, board_of, silent_bus

CLASS = """
from cxbridge.skiller.board import SkillExecutor

class Wave(SkillExecutor):
    skills = ("wave", "bow")
    known_settings = ("times",)

    def execute(self, call):
        yield 0.5
"""


class Wave(SkillExecutor):
    skills = ("wave", "bow")


@pytest.fixture
def board(monkeypatch):
    with board_of(skill, monkeypatch) as board:
        yield board


def executor(board, agent, name):
    context = ExecutorContext(agent, board, RealClock(), silent_bus().logger(name))
    return ExecutorHost(Wave(context), name)


def test_board_lists_executors_by_agent(board, capsys):
    for agent, name in (("r2", "b"), ("r1", "z"), ("r1", "a")):
        executor(board, agent, name)
    assert invoke(["skill", "board"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "r1: a (wave, bow) IDLE",
        "r1: z (wave, bow) IDLE",
        "r2: b (wave, bow) IDLE",
    ]
    assert invoke(["skill", "board", "--json"]) == 0
    first = json.loads(capsys.readouterr().out)[0]
    assert first == {
        "executor": "a",
        "agent": "r1",
        "skills": ["wave", "bow"],
        "state": "IDLE",
        "skill": "",
        "board": "",
        "master": 0,
    }


def test_board_prints_activity_of_executor(board, capsys):
    host = executor(board, "r1", "e1")
    host._interface.state, host._interface.skill = "BUSY", "wave"
    host._interface.board, host._interface.master = "SkillBoard", 3
    host._interface.write()
    assert invoke(["skill", "board"]) == 0
    assert capsys.readouterr().out == "r1: e1 (wave, bow) BUSY: wave for SkillBoard, action 3\n"


def test_skiller_of_board_has_skills_of_executors(board, capsys):
    executor(board, "r1", "e1")
    for agent in ("r1", "r2"):
        board.open_for_writing("SkillerInterface", agent, owner="test")
    assert invoke(["skill", "list"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "r1: S_INACTIVE '', controlled by nobody",
        "  bow",
        "  wave",
        "r2: S_INACTIVE '', controlled by nobody",
        "  (it does not report its skills)",
    ]


def test_empty_board_prints_message(board, capsys):
    assert invoke(["skill", "board"]) == 0
    assert capsys.readouterr() == ("", "there is no executor\n")


@pytest.mark.parametrize(
    ("target", "settings", "message"),
    [
        ("wave.py:Nobody", [], "has no executor 'Nobody'"),
        ("wave.py", [], "is not the name of an executor class"),
        ("none.py:Wave", [], "there is no such file"),
        ("no.such:Wave", [], "there is no Python module 'no.such'"),
        ("wave.py:Wave", ["times"], "'times' is not a setting"),
    ],
)
def test_invalid_target_or_setting_is_one_message(tmp_path, monkeypatch, capsys, target, settings, message):
    (tmp_path / "wave.py").write_text(CLASS)
    monkeypatch.chdir(tmp_path)
    options = [part for setting in settings for part in ("--set", setting)]
    assert invoke(["skill", "executor", target, "--agent", "r1", *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


@pytest.mark.parametrize(
    ("agent", "settings", "message"),
    [("r1", ("arms=2",), "has no setting 'arms'"), ("x" * 65, (), "an agent cannot be called")],
)
def test_failed_executor_leaves_no_interface(tmp_path, monkeypatch, agent, settings, message):
    (tmp_path / "wave.py").write_text(CLASS)
    shared = SharedBoard()
    monkeypatch.setattr("cxbridge.daemon.services.service.open_blackboard", lambda *_: shared)
    options = ExecutorOptions(
        target=f"{tmp_path}/wave.py:Wave", agent=agent, url="x", name="e1", settings=settings
    )
    with pytest.raises(Exception, match=message):
        run_executor(options)
    assert shared.list_all() == []
    shared.shutdown()
