"""The Skiller, by sections 2 (exclusive control) and 3 (execution and status) of the facts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.events import Level, LogLine
from cxbridge.skiller.backend import Mode
from tests.skiller.rig import SKILLS, Rig, write_skills


@pytest.fixture
def skills(tmp_path: Path) -> Path:
    return write_skills(tmp_path, SKILLS)


def make(skills: Path, mode: Mode = "strict") -> Rig:
    rig = Rig()
    rig.lua([skills], space="space", mode=mode)
    rig.loop()
    rig.forget()
    return rig


@pytest.fixture
def rig(skills: Path) -> Rig:
    """A Skiller after its first loop, without a controller."""
    return make(skills)


@pytest.fixture
def lua(skills: Path) -> Rig:
    """A Skiller that evaluates skill strings as Lua."""
    return make(skills, "fawkes")


def take_control(rig: Rig, by: object = None, *, steal: bool = False) -> None:
    rig.send("AcquireControl", steal, by=by)
    rig.loop()


# -- section 2: exclusive control


@pytest.mark.parametrize(
    ("message", "values", "owned", "sender", "controller", "line"),
    [
        ("AcquireControl", [False], False, 1, 1, "MainThread (serial {}) is new exclusive controller"),
        ("AcquireControl", [False], True, 1, 1, ""),
        (
            "AcquireControl", [False], True, 2, 1,
            "MainThread tried to acquire exclusive control, but another controller exists already",
        ),
        ("AcquireControl", [True], False, 2, 2, "MainThread (serial {}) is new exclusive controller"),
        ("AcquireControl", [True], True, 1, 1, "MainThread (serial {}) steals exclusive control"),
        ("AcquireControl", [True], True, 2, 2, "MainThread (serial {}) steals exclusive control"),
        ("ReleaseControl", [], False, 1, 0, ""),
        ("ReleaseControl", [], True, 1, 0, "MainThread releases exclusive control"),
        (
            "ReleaseControl", [], True, 2, 1,
            "MainThread tried to release exclusive control, but it's not the controller",
        ),
        (
            "ExecSkill", ["count{}"], False, 1, 0,
            "MainThread executes 'count{{}}' without any exclusive controller",
        ),
        ("ExecSkill", ["count{}"], True, 1, 1, "MainThread executes 'count{{}}'"),
        ("ExecSkill", ["count{}"], True, 2, 1, "MainThread tries to exec, but other thread is controller"),
        (
            "RestartInterpreter", [], False, 1, 0,
            "Unhandled message of type RestartInterpreterMessage in skiller interface",
        ),
    ],
)  # fmt: skip
def test_control_by_message_owner_and_sender(
    rig: Rig, message: str, values: list[Any], owned: bool, sender: int, controller: int, line: str
):
    """Two clients send; client 1 is the controller, if there is a controller."""
    clients = {1: rig.commander, 2: rig.reader()}
    if owned:
        take_control(rig)
    rig.forget()
    rig.send(message, *values, by=clients[sender])
    rig.loop()
    assert rig.state.exclusive_controller == (str(clients[controller].serial) if controller else "")
    logged = [event.text for event in rig.events if isinstance(event, LogLine)]
    assert logged[:1] == ([line.format(clients[sender].serial)] if line else [])
    assert line or rig.events == []
    is_executed = message == "ExecSkill" and controller in (0, sender)
    assert (rig.state.skill_string, rig.status) == (
        ("count{}", "S_RUNNING") if is_executed else ("", "S_INACTIVE")
    )
    assert rig.state.msgid == (2 if is_executed and owned else int(is_executed))


@pytest.mark.parametrize(
    ("owned", "sender", "remote", "line"),
    [
        (False, 1, False, "Stopping execution of 'count{}' on request"),  # Fawkes ignores the message
        (True, 1, False, "Stopping execution of 'count{}' on request"),
        (True, 2, False, "MainThread sent stop without any exclusive controller"),
        (True, 2, True, "Remote sent stop without any exclusive controller"),
    ],
)
def test_stop_by_owner_and_sender(rig: Rig, owned: bool, sender: int, remote: bool, line: str):
    clients = {1: rig.commander, 2: rig.reader()}
    if owned:
        take_control(rig)
    number = rig.exec("count{to=9}")
    rig.send("StopExec", by=clients[sender], remote=remote)
    rig.loop(2)
    logged = rig.logged(Level.DEBUG)
    assert line.replace("count{}", "count{to=9}") in logged
    is_stopped = sender == 1
    assert ("leave COUNT" in logged) is is_stopped
    expected = ("", 0, "S_INACTIVE") if is_stopped else ("count{to=9}", number, "S_RUNNING")
    assert (rig.state.skill_string, rig.state.msgid, rig.status) == expected


def test_closed_reader_of_controller_revokes_control_but_skill_runs(rig: Rig):
    controller = rig.reader()
    take_control(rig, controller)
    rig.send("ExecSkill", "count{}", by=controller)
    rig.loop()
    rig.forget()
    rig.board.close(controller)
    rig.loop()
    assert rig.writes("exclusive_controller", "status") == [("", "S_RUNNING")]
    assert rig.logged(Level.INFO) == ["Controlling interface instance was closed, revoking exclusive control"]
    rig.loop()
    assert rig.status == "S_FINAL"


# -- section 3: execution and status


def test_new_skill_string_aborts_running_skill_string(rig: Rig):
    rig.exec("count{}")
    rig.forget()
    rig.exec("count{to=5}")
    assert "Aborting execution of previous skill string 'count{}' for new goal" in rig.logged(Level.INFO)
    rig.loop(3)
    assert rig.status == "S_RUNNING"
    rig.loop()
    assert rig.status == "S_FINAL"


def test_last_exec_of_loop_counts(rig: Rig):
    rig.send("ExecSkill", "fail{}")
    last = rig.send("ExecSkill", "count{}")
    rig.loop()
    assert "More than one skill string enqueued, ignoring previous string (fail{})." in rig.logged(Level.WARN)
    assert rig.writes("skill_string", "msgid", "status") == [("count{}", last, "S_RUNNING")]


def test_exec_publishes_skill_string_before_first_run(rig: Rig):
    number = rig.exec("count{tell=true}")
    assert rig.writes("skill_string", "msgid", "status")[0] == ("count{tell=true}", number, "S_RUNNING")
    texts = [getattr(event, "text", None) or event.uid for event in rig.events]
    assert texts.index("SkillerInterface::Skiller") < texts.index("n=1")


@pytest.mark.parametrize(
    ("mode", "problem"),
    [
        ("strict", "column 7: the skill string ends where a literal should be"),
        ("fawkes", '[string "count{"]:1: unexpected symbol'),
    ],
)
def test_syntax_error_fails_without_execution(skills: Path, mode: Mode, problem: str):
    rig = make(skills, mode)
    rig.exec("count{", loops=2)
    assert rig.writes("status") == ["S_FAILED"]
    (line,) = rig.logged(Level.ERROR)
    assert line.startswith(f"Failed to compile skill string: count{{|{problem}")
    assert rig.state.error.startswith(problem)


def test_lua_error_fails_with_error_text(lua: Rig):
    rig, text = lua, 'error("no way")'
    rig.exec(text, loops=2)
    assert rig.state.error.startswith('error("no way")|[string "error("no way")"]:1: no way\nstack traceback')
    assert len(rig.state.error) == 127
    assert rig.writes("status") == ["S_RUNNING", "S_FAILED"]
    assert f"Failed to execute skill: {text}|" in rig.logged(Level.ERROR)[0]


@pytest.mark.parametrize(
    ("mode", "error"),
    [
        ("strict", "column 1: there is no skill 'dance'; only /skiller/mode: fawkes evaluates Lua"),
        ("fawkes", "attempt to call global 'dance'"),
    ],
)
def test_missing_skill_fails(skills: Path, mode: Mode, error: str):
    rig = make(skills, mode)
    rig.exec("dance{}")
    assert error in rig.state.error


def test_status_is_published_on_change_only(rig: Rig):
    number = rig.exec("count{}", loops=5)
    assert rig.writes("status", "error") == [("S_RUNNING", ""), ("S_FINAL", "")]
    assert (rig.state.skill_string, rig.state.msgid) == ("count{}", number)
    assert not rig.backends[0].running
    rig.exec("count{tell=true}", loops=5)  # the skills were reset
    assert [text for text in rig.logged(Level.INFO) if text.startswith("n=")] == ["n=1", "n=2", "n=3"]


def test_failed_skill_publishes_error(rig: Rig):
    """Fawkes writes twice: write_fsm_error() writes separately."""
    rig.exec('fail{why="x"}')
    assert (rig.status, rig.state.error) == ("S_FAILED", "on purpose")
    assert rig.writes("status") == ["S_RUNNING", "S_FAILED"]


def test_failed_skill_without_error_publishes_label(rig: Rig):
    """Fawkes keeps the error of an earlier failure; cxbridge publishes the label of the transition."""
    rig.exec('fail{why="x"}', loops=2)
    rig.exec("fail{}", loops=2)
    assert (rig.status, rig.state.error) == ("S_FAILED", "only a label")


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("done{}", "S_FINAL"),
        ("done{} count{}", "S_RUNNING"),
        ('done{} count{} fail{why="x"}', "S_FAILED"),
        ("", "S_INACTIVE"),
    ],
)
def test_overall_status_of_skills(rig: Rig, text: str, status: str):
    rig.exec(text)
    assert rig.status == status


def test_first_loop_writes_both_debug_interfaces(skills: Path):
    rig = Rig()
    rig.lua([skills], space="space")
    rig.loop()
    for suffix in ("", "Layouted"):
        assert rig.writes("graph_colored", "graph", uid=f"SkillerDebugInterface::Skiller{suffix}") == [
            (True, "")
        ]


def test_second_skiller_on_interface_is_refused(skills: Path, rig: Rig):
    with pytest.raises(BlackBoardError):
        rig.lua([skills], space="space")


def test_close_frees_interfaces(skills: Path, rig: Rig):
    rig.backends.pop().close()
    rig.lua([skills], space="space").close()
    assert not rig.commander.has_writer


# -- SkillerDebugInterface


def debug_reader(rig: Rig):
    return rig.board.open_for_reading("SkillerDebugInterface", "Skiller", owner="viewer")


def graph_of(reader) -> Any:
    reader.read()
    return reader.graph


def test_graph_of_running_machine_is_published(rig: Rig):
    viewer = debug_reader(rig)
    rig.exec("count{}")
    graph = graph_of(viewer)
    assert viewer.graph_fsm == "ACTIVE"
    assert graph.startswith("digraph count {\n")
    (line,) = [line for line in graph.splitlines() if line.startswith("\tCOUNT [")]
    assert sorted(line[8:-2].split(", ")) == [
        'active="true"',
        'color="#ffc080"',
        'fillcolor="#ffc080"',
        'penwidth="4.0"',
    ]
    assert '\tCOUNT -> FINAL [label="counted"];' in graph


def test_viewers_request_graphs(rig: Rig):
    viewer = debug_reader(rig)

    def ask(kind: str, value: object) -> str:
        viewer.msgq_enqueue(viewer.MESSAGES[f"{kind}Message"](value))
        rig.loop()
        graph: str = graph_of(viewer)
        return graph

    assert ask("SetGraph", "LIST") == "count\nfail\ndone\n"
    assert ask("SetGraph", "SKILL_DEP").startswith("digraph skill_dependencies {")
    assert ask("SetGraph", "fail").startswith("digraph fail {")
    assert 'rankdir="LR"' in ask("SetGraphDirection", viewer.GD_LEFT_RIGHT)
    assert "#cacaff" not in ask("SetGraphColored", False)
    assert ask("SetGraph", "dance") == ""
    assert rig.logged(Level.WARN) == ["Could not write FSM graph, FSM for dance not found"]


# -- texts outside UTF-8


def test_error_text_outside_utf8_is_readable(lua: Rig):
    lua.exec(r"error('a\255b')")
    assert "a\N{REPLACEMENT CHARACTER}b" in lua.state.error
