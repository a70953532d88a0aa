"""The Lua engine: loading of skill spaces, the sandbox, and its bounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import SkillError
from cxbridge.events import Level
from cxbridge.skiller.lua.limits import MEBIBYTE, Limits
from tests.skiller.rig import SKILLS, Rig, write_skills

# Instructions are the limit rather than time, which differs between machines.
SMALL = Limits(
    instructions_per_loop=200_000, instructions_to_load=200_000, seconds_per_loop=10, memory=16 * MEBIBYTE
)


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig()
    rig.lua([write_skills(tmp_path, SKILLS)], space="space", limits=SMALL, mode="fawkes")
    return rig


def load(tmp_path: Path, text: str, name: str = "bad") -> Rig:
    """Load a space with a single skill file."""
    write_skills(tmp_path, {"one": f'skillenv.use_skill("skills.{name}")', name: text})
    rig = Rig()
    rig.lua([tmp_path], space="one", limits=SMALL, mode="fawkes")
    return rig


# -- loading


def test_syntax_error_in_skill_file_has_file_and_line(tmp_path: Path):
    with pytest.raises(SkillError, match="'end' expected") as caught:
        load(tmp_path, "module(..., skillenv.module_init)\nfunction f()\nx = 1\n")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "bad.lua"), 4)


def test_runtime_error_in_skill_file_has_file_and_line(tmp_path: Path):
    with pytest.raises(SkillError, match="attempt to index global 'nothing'") as caught:
        load(tmp_path, "\nlocal x = nothing.field\n")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "bad.lua"), 2)


def test_endless_loop_in_skill_file_is_error(tmp_path: Path):
    with pytest.raises(SkillError, match="endless loop") as caught:
        load(tmp_path, "\n\nwhile true do end")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "bad.lua"), 3)


def test_missing_skill_space_is_error():
    with pytest.raises(SkillError, match=r"Lua module 'skills.nowhere' not found in .*luaskills"):
        Rig().lua(space="nowhere")


HEAD = "module(..., skillenv.module_init)\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + 'documentation = ""\nskillenv.skill_module(_M)', "Skill name not set or not a string"),
        (HEAD + 'name = "x"\nskillenv.skill_module(_M)', "Skill documentation missing or not a string"),
        (HEAD + 'name = "x"\ndocumentation = ""', "neither provide execute"),
        (
            HEAD + 'name = "x"\ndocumentation = ""\ndepends_skills = {"y"}\nskillenv.skill_module(_M)',
            "Skill y has not been added, dependencies for x cannot be met",
        ),
        (
            HEAD + 'name = "x"\ndocumentation = ""\n'
            'depends_interfaces = {{v = "i", type = "NoInterface", id = "I"}}\nskillenv.skill_module(_M)',
            "Interface of type 'NoInterface' not found",
        ),
        (HEAD + 'fsm = SkillHSM:new{start = "A"}', "FSM requires a name"),
        (HEAD + 'fsm = SkillHSM:new{name = "x"}', "FSM requires start state"),
        (
            HEAD
            + 'fsm = SkillHSM:new{name = "x", start = "A"}\nfsm:define_states{export_to = _M, {"A", Jump}}',
            "class instance for state A not defined",
        ),
        (
            HEAD + 'fsm = SkillHSM:new{name = "x", start = "A"}\nfsm:define_states{"A"}\n'
            'fsm:add_transitions{{"A", "B", cond = true}}',
            "Destination state does not exist for transition A -> B",
        ),
        (
            HEAD + 'fsm = SkillHSM:new{name = "x", start = "A"}\nfsm:define_states{"A"}\n'
            'fsm:add_transitions{{"A", "FINAL"}}',
            "You must have a condition or a timeout for transition A -> FINAL",
        ),
        (
            HEAD + 'fsm = SkillHSM:new{name = "x", start = "A"}\nfsm:define_states{"A"}\n'
            'fsm:add_transitions{{"A", "FINAL", cond = "("}}',
            "compiling jump condition",
        ),
    ],
)
def test_broken_skill_file_is_error_with_place(tmp_path: Path, text: str, message: str):
    with pytest.raises(SkillError) as caught:
        load(tmp_path, text)
    assert message in str(caught.value)
    assert (caught.value.file, caught.value.line is None) == (
        (str(tmp_path / "one.lua"), False)
        if message.startswith("neither")
        else (str(tmp_path / "bad.lua"), False)
    )


def test_duplicate_skill_name_is_error(tmp_path: Path):
    write_skills(tmp_path, SKILLS | {"space": SKILLS["space"] + 'skillenv.use_skill("skills.again")'})
    write_skills(tmp_path, {"again": SKILLS["done"]})
    with pytest.raises(SkillError, match="A skill with the name done already exists"):
        Rig().lua([tmp_path], space="space")


def test_failed_load_closes_interfaces(tmp_path: Path):
    text = HEAD + 'name = "x"\ndocumentation = ""\n'
    text += 'depends_interfaces = {{v = "i", type = "SpeechSynthInterface", id = "Flite", writing = true}}\n'
    text += "skillenv.skill_module(_M)\nerror('late')"
    write_skills(tmp_path, {"one": 'skillenv.use_skill("skills.x")', "x": text})
    rig = Rig()
    with pytest.raises(SkillError, match="late"):
        rig.lua([tmp_path], space="one")
    assert [info.uid for info in rig.board.list() if info.type == "SpeechSynthInterface"] == []


# -- the sandbox


@pytest.mark.parametrize(
    "expression",
    [
        "io", "require", "loadstring", "load", "dofile", "loadfile", "debug", "package", "python", "pcall",
        "setfenv", "getfenv", "getmetatable", "setmetatable", "rawset", "coroutine", "collectgarbage", "_G",
        "tonumber", "os.execute", "os.remove", "os.exit", "os.rename", "os.tmpname", "string.dump",
    ],
)  # fmt: skip
def test_skill_strings_do_not_see_dangerous_names(rig: Rig, expression: str):
    rig.exec(f"assert({expression} == nil)")
    assert rig.status == "S_INACTIVE"


@pytest.mark.parametrize(
    "expression", ["io", "loadstring", "load", "dofile", "python", "os.execute", "getfenv"]
)
def test_skill_files_do_not_see_dangerous_names(tmp_path: Path, expression: str):
    write_skills(tmp_path, {"one": f"assert({expression} == nil and _G.{expression} == nil)"})
    Rig().lua([tmp_path], space="one")


def test_skill_files_get_debug_traceback_only(tmp_path: Path):
    text = "local n = 0; for k in pairs(debug) do n = n + 1 end; assert(n == 1 and debug.traceback)"
    write_skills(tmp_path, {"one": text})
    Rig().lua([tmp_path], space="one")


@pytest.mark.parametrize(
    "text",
    [
        "os.time = nil", "string.format = nil", "math.floor = nil", "table.insert = nil",
        "count.name = 1", "skills[1] = nil", "clock.now = nil", "config.exists = nil", "('x').x.y = 1",
    ],
)  # fmt: skip
def test_skill_strings_cannot_change_shared_tables(rig: Rig, text: str):
    rig.exec(text)
    assert rig.status == "S_FAILED"
    rig.exec("count{}", loops=3)
    assert rig.status == "S_FINAL"


@pytest.mark.parametrize(
    "name",
    [
        "assert", "error", "ipairs", "next", "pairs", "select", "tostring", "type", "unpack", "xpcall",
        "print", "printf", "print_debug", "print_info", "print_warn", "print_error", "sinfo", "skill_info",
        "logger", "config", "clock", "blackboard", "math", "string", "table", "skills", "os.date",
        "os.getenv", "os.time", "os.difftime", "S_INACTIVE", "S_FINAL", "S_RUNNING", "S_FAILED", "count",
    ],
)  # fmt: skip
def test_skill_strings_see_documented_names(rig: Rig, name: str):
    rig.exec(f"assert({name} ~= nil)")
    assert rig.status == "S_INACTIVE"


def test_time_in_lua_is_time_of_run(rig: Rig):
    rig.exec("print_info('%d', os.time())")
    assert rig.logged(Level.INFO)[-1] == "1000000000"


def test_random_numbers_repeat(tmp_path: Path):
    def draw() -> str:
        rig = Rig()
        rig.lua([write_skills(tmp_path, SKILLS)], space="space", mode="fawkes")
        rig.exec("print_info('%d %d', math.random(1000), math.random(5, 6))")
        return rig.logged(Level.INFO)[-1]

    assert draw() == draw()


def test_bytes_outside_utf8_reach_log(rig: Rig):
    rig.exec(r"local s = 'a\255b'; assert(#s == 3); print_info(s)")
    assert rig.logged(Level.INFO)[-1] == "a�b"


# -- bounds


def test_endless_loop_in_state_fails_skill_string(tmp_path: Path):
    text = SKILLS["count"].replace("fsm.vars.n = fsm.vars.n + 1", "while true do pcall(function() end) end")
    rig = load(tmp_path, text, name="count")
    rig.exec("count{}")
    assert rig.status == "S_FAILED"
    assert "count.lua:11: endless loop?" in rig.logged(Level.ERROR)[0]


def test_endless_loop_in_exit_is_stopped(tmp_path: Path):
    rig = load(
        tmp_path, SKILLS["count"].replace('print_debug("leave COUNT")', "while true do end"), name="count"
    )
    rig.exec("count{to=9}")
    rig.exec("print_info('next')")
    assert "endless loop?" in rig.logged(Level.ERROR)[0]
    assert rig.logged(Level.INFO)[-1] == "next"


@pytest.mark.parametrize(
    "text", ["local s = 'x'; while true do s = s .. s end", "local t = {}; for i = 1, 1e9 do t[i] = i end"]
)
def test_memory_bomb_fails_skill_string(tmp_path: Path, text: str):
    rig = Rig()
    limits = Limits(instructions_per_loop=100_000_000, seconds_per_loop=10, memory=16 * MEBIBYTE)
    rig.lua([write_skills(tmp_path, SKILLS)], space="space", limits=limits, mode="fawkes")
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert "not enough memory" in rig.state.error
    rig.exec("count{}", loops=3)
    assert rig.status == "S_FINAL"


def test_unbounded_recursion_fails_skill_string(rig: Rig):
    rig.exec("local function f() return 1 + f() end; f()")
    assert "stack overflow" in rig.state.error
