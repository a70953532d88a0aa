"""The Skiller, row by row of sections 2 (exclusive control) and 3 (execution and status) of the facts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.events import Level
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
    """A Skiller that has done its first loop, without a controller."""
    return make(skills)


@pytest.fixture
def lua(skills: Path) -> Rig:
    """The same, which evaluates skill strings as Lua."""
    return make(skills, "fawkes")


def take_control(rig: Rig, by: object = None, *, steal: bool = False) -> None:
    rig.send("AcquireControl", steal, by=by)
    rig.loop()


# -- section 2: exclusive control


def test_acquire_without_controller_is_granted_and_leaves_msgid(rig: Rig):
    take_control(rig)
    assert rig.writes("exclusive_controller", "msgid") == [(str(rig.commander.serial), 0)]
    assert rig.logged(Level.DEBUG) == [
        f"MainThread (serial {rig.commander.serial}) is new exclusive controller"
    ]


def test_acquire_by_the_controller_is_ignored_silently(rig: Rig):
    take_control(rig)
    rig.forget()
    take_control(rig)
    assert rig.events == []


def test_acquire_with_another_controller_is_refused_with_a_warning(rig: Rig):
    take_control(rig)
    rig.forget()
    take_control(rig, rig.reader())
    assert rig.writes("status") == []
    assert rig.logged(Level.WARN) == [
        "MainThread tried to acquire exclusive control, but another controller exists already"
    ]


@pytest.mark.parametrize("owner", ["nobody", "self", "other"])
def test_steal_takes_control_from_whoever_has_it(rig: Rig, owner: str):
    thief = rig.reader()
    if owner != "nobody":
        take_control(rig, thief if owner == "self" else None)
    rig.forget()
    take_control(rig, thief, steal=True)
    assert rig.writes("exclusive_controller") == [str(thief.serial)]
    warnings = [] if owner == "nobody" else [f"MainThread (serial {thief.serial}) steals exclusive control"]
    assert rig.logged(Level.WARN) == warnings


def test_release_without_controller_is_ignored_silently(rig: Rig):
    rig.send("ReleaseControl")
    rig.loop()
    assert rig.events == []


def test_release_by_the_controller_clears_the_field(rig: Rig):
    take_control(rig)
    rig.forget()
    rig.send("ReleaseControl")
    rig.loop()
    assert rig.writes("exclusive_controller") == [""]
    assert rig.logged(Level.DEBUG) == ["MainThread releases exclusive control"]


def test_release_by_another_is_refused_with_a_warning(rig: Rig):
    take_control(rig)
    rig.forget()
    rig.send("ReleaseControl", by=rig.reader())
    rig.loop()
    assert rig.writes("status") == []
    assert rig.logged(Level.WARN) == [
        "MainThread tried to release exclusive control, but it's not the controller"
    ]


@pytest.mark.parametrize(("remote", "who"), [(False, "MainThread"), (True, "Remote")])
def test_exec_without_controller_is_executed_with_a_debug_line(rig: Rig, remote: bool, who: str):
    rig.send("ExecSkill", "count{}", remote=remote)
    rig.loop()
    assert rig.writes("skill_string", "status") == [("count{}", "S_RUNNING")]
    assert rig.logged(Level.DEBUG)[0] == f"{who} executes 'count{{}}' without any exclusive controller"


def test_exec_by_the_controller_is_executed_with_an_info_line(rig: Rig):
    take_control(rig)
    rig.exec("count{}")
    assert rig.status == "S_RUNNING"
    assert rig.logged(Level.INFO) == ["MainThread executes 'count{}'"]


def test_exec_by_another_is_dropped_with_a_warning(rig: Rig):
    take_control(rig)
    rig.forget()
    rig.send("ExecSkill", "count{}", by=rig.reader())
    rig.loop()
    assert rig.writes("status") == []
    assert rig.logged(Level.WARN) == ["MainThread tries to exec, but other thread is controller"]


def test_stop_without_controller_is_executed(rig: Rig):
    """Fawkes ignores it."""
    rig.exec("count{}")
    rig.send("StopExec")
    rig.loop()
    assert rig.status == "S_INACTIVE"


def test_stop_by_the_controller_is_executed(rig: Rig):
    take_control(rig)
    rig.exec("count{}")
    rig.send("StopExec")
    rig.loop(3)
    assert (rig.status, rig.state.skill_string, rig.state.msgid) == ("S_INACTIVE", "", 0)
    assert "Stopping execution of 'count{}' on request" in rig.logged(Level.DEBUG)


def test_stop_by_another_is_ignored(rig: Rig):
    take_control(rig)
    rig.exec("count{}")
    rig.send("StopExec", by=rig.reader())
    rig.loop()
    assert rig.status == "S_RUNNING"


def test_closing_the_controllers_reader_revokes_control_and_the_skill_goes_on(rig: Rig):
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


def test_closing_another_reader_changes_nothing(rig: Rig):
    take_control(rig)
    other = rig.reader()
    rig.forget()
    rig.board.close(other)
    rig.loop()
    assert rig.events == []


def test_stealing_and_releasing_do_not_stop_the_skill(rig: Rig):
    take_control(rig)
    rig.exec("count{}")
    thief = rig.reader()
    take_control(rig, thief, steal=True)
    rig.send("ReleaseControl", by=thief)
    rig.loop()
    assert rig.status == "S_FINAL"


def test_restart_interpreter_is_not_handled(rig: Rig):
    rig.send("RestartInterpreter")
    rig.loop()
    assert rig.logged(Level.WARN) == [
        "Unhandled message of type RestartInterpreterMessage in skiller interface"
    ]


# -- section 3: execution and status


def test_a_running_skill_string_is_aborted_for_a_new_one(rig: Rig):
    rig.exec("count{}")
    rig.forget()
    rig.exec("count{to=5}")
    assert "Aborting execution of previous skill string 'count{}' for new goal" in rig.logged(Level.INFO)
    rig.loop(3)
    assert rig.status == "S_RUNNING"
    rig.loop()
    assert rig.status == "S_FINAL"


def test_of_several_exec_in_one_loop_the_last_one_counts(rig: Rig):
    rig.send("ExecSkill", "fail{}")
    last = rig.send("ExecSkill", "count{}")
    rig.loop()
    assert "More than one skill string enqueued, ignoring previous string (fail{})." in rig.logged(Level.WARN)
    assert rig.writes("skill_string", "msgid", "status") == [("count{}", last, "S_RUNNING")]


def test_exec_sets_skill_string_msgid_and_running_before_the_first_run(rig: Rig):
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
def test_a_syntax_error_is_failed_and_nothing_runs(skills: Path, mode: Mode, problem: str):
    rig = make(skills, mode)
    rig.exec("count{", loops=2)
    assert rig.writes("status") == ["S_FAILED"]
    (line,) = rig.logged(Level.ERROR)
    assert line.startswith(f"Failed to compile skill string: count{{|{problem}")
    assert rig.state.error.startswith(problem)


def test_a_lua_error_gives_the_error_text_and_failed(lua: Rig):
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
def test_a_missing_skill_fails(skills: Path, mode: Mode, error: str):
    rig = make(skills, mode)
    rig.exec("dance{}")
    assert error in rig.state.error


def test_the_status_is_published_on_change_only(rig: Rig):
    rig.exec("count{}", loops=5)
    assert rig.writes("status", "error") == [("S_RUNNING", ""), ("S_FINAL", "")]


def test_a_failing_skill_publishes_its_error(rig: Rig):
    """Fawkes writes twice: write_fsm_error() writes separately."""
    rig.exec('fail{why="x"}')
    assert (rig.status, rig.state.error) == ("S_FAILED", "on purpose")
    assert rig.writes("status") == ["S_RUNNING", "S_FAILED"]


def test_a_failing_skill_without_an_error_text(rig: Rig):
    """Fawkes keeps the text of an earlier failure; here the label of the transition is the text."""
    rig.exec('fail{why="x"}', loops=2)
    rig.exec("fail{}", loops=2)
    assert (rig.status, rig.state.error) == ("S_FAILED", "only a label")


def test_after_the_end_string_msgid_and_status_stay(rig: Rig):
    number = rig.exec("count{}", loops=10)
    assert (rig.state.skill_string, rig.state.msgid, rig.status) == ("count{}", number, "S_FINAL")


def test_at_the_end_all_skills_are_reset(rig: Rig):
    for _ in range(2):
        rig.forget()
        rig.exec("count{tell=true}", loops=5)
        assert [text for text in rig.logged(Level.INFO) if text.startswith("n=")] == ["n=1", "n=2", "n=3"]


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("done{}", "S_FINAL"),
        ("done{} count{}", "S_RUNNING"),
        ('done{} count{} fail{why="x"}', "S_FAILED"),
        ("", "S_INACTIVE"),
    ],
)
def test_overall_status(rig: Rig, text: str, status: str):
    rig.exec(text)
    assert rig.status == status


def test_a_skill_that_ends_in_its_first_loop_is_written_running_and_final_in_it(rig: Rig):
    rig.exec("done{}")
    assert rig.writes("status") == ["S_RUNNING", "S_FINAL"]


def test_stop_publishes_inactive_and_msgid_zero(rig: Rig):
    take_control(rig)
    rig.exec("count{}")
    rig.forget()
    rig.send("StopExec")
    rig.loop()
    assert set(rig.writes("skill_string", "msgid", "status")) == {("", 0, "S_INACTIVE")}
    assert "leave COUNT" in rig.logged(Level.DEBUG)


def test_the_first_loop_writes_both_debug_interfaces(skills: Path):
    rig = Rig()
    rig.lua([skills], space="space")
    rig.loop()
    for suffix in ("", "Layouted"):
        assert rig.writes("graph_colored", "graph", uid=f"SkillerDebugInterface::Skiller{suffix}") == [
            (True, "")
        ]


def test_only_one_skiller_may_write_an_interface(skills: Path, rig: Rig):
    with pytest.raises(BlackBoardError):
        rig.lua([skills], space="space")


def test_running_tells_whether_a_run_may_end(skills: Path):
    rig = make(skills)
    (skiller,) = rig.backends
    states = [skiller.running]
    rig.send("ExecSkill", "count{}")
    states.append(skiller.running)
    rig.loop(2)
    states.append(skiller.running)
    rig.loop()
    states.append(skiller.running)
    assert states == [False, True, True, False]


def test_closing_frees_the_interfaces(skills: Path, rig: Rig):
    rig.backends.pop().close()
    rig.lua([skills], space="space").close()
    assert not rig.commander.has_writer


# -- SkillerDebugInterface


def debug_reader(rig: Rig):
    return rig.board.open_for_reading("SkillerDebugInterface", "Skiller", owner="viewer")


def graph_of(reader) -> Any:
    reader.read()
    return reader.graph


def test_the_graph_of_the_running_machine_is_published(rig: Rig):
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


def test_viewers_ask_for_other_graphs(rig: Rig):
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


# -- texts that are no plain text


@pytest.mark.parametrize("mode", ["strict", "fawkes"])
def test_a_skill_string_that_is_no_utf8_is_run_as_it_is(skills: Path, mode: Mode):
    rig = make(skills, mode)
    message = rig.commander.MESSAGES["ExecSkillMessage"]()
    chunk = bytearray(message.to_bytes())
    text = b"print_info('%d', #'a\xffb')" if mode == "fawkes" else b"count{tell='a\xffb'}"
    offset = message.field("skill_string").offset
    chunk[offset : offset + len(text)] = text
    message.set_from_chunk(chunk)
    rig.commander.msgq_enqueue(message)
    rig.loop()
    assert rig.logged(Level.INFO) == ["3" if mode == "fawkes" else "n=1"]


def test_an_error_text_that_is_no_utf8_is_readable(lua: Rig):
    lua.exec(r"error('a\255b')")
    assert "a\N{REPLACEMENT CHARACTER}b" in lua.state.error
