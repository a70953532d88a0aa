"""Skill strings of attackers: as data they do nothing, as Lua they reach nothing and delay no loop.

No test looks at a clock: the engine counts instructions, or refuses before the execution. The fuzzer measures
the time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.events import Level
from cxbridge.skiller.lua.limits import MEBIBYTE, Limits
from cxbridge.skiller.skillstring import ONLY_FAWKES
from tests.skiller.rig import SKILLS, Rig, write_skills
from tests.support import module_files

LIMITS = Limits(instructions_per_loop=200_000, seconds_per_loop=10, memory=64 * MEBIBYTE)

TRICKS = [
    # from a skill's table to its module
    "count.module('x')", "count.pcall(error)", "count.setmetatable({}, {})", "count.package.loaded.x = 1",
    "count._M._G.x = 1", "skills[1].module('x')", "skills[1].fsm.vars.x = 1",
    "count.fsm:reset()",
    # objects of the skills' environment
    "clock.now = nil", "clock:instance().now = nil", "clock:now().__index.new = nil", "config.exists = nil",
    "blackboard:open_for_reading('SpeechSynthInterface', 'x').SayMessage.new = nil", "logger.log_info = nil",
    "local now = clock:now(); now.us = 1", "math.pi = 3", "('x').y.z = 1", "skills[1] = nil",
    "count.name = 'x'",
    # Lua's introspection
    "getfenv(0)", "setfenv(1, {})", "getmetatable('').__index = nil", "debug.getinfo(1)", "loadstring('x')",
    "load('x')", "string.dump(print)", "coroutine.create(print)", "newproxy(true)", "require('x')",
    "dofile('x')",
    "rawset(math, 'x', 1)", "collectgarbage()", "python.eval('1')", "io.open('x')", "os.execute('true')",
    "tf:lookup_transform('a', 'b', {})", "count{f = function() end}", "tf:can_transform(function() end)",
    # errors that are no texts
    "error(count)", "error({})", "error(nil)", "error(function() end)", "xpcall(error, error) error()",
    # texts that are no Lua
    "\x1bLua", "\x1bLuaQ\x00\x01\x04\x04\x04\x08\x00",
]  # fmt: skip

ENDLESS = [
    "while true do end", "while true do xpcall(function() while true do end end, tostring) end",
    "xpcall(function() error('x') end, function() while true do end end)",
    "xpcall(function() while true do end end, function() while true do end end)",
    "local f; f = function() return f() end; f()", "for i = 1, 1e9 do print_info('x') end",
    "for i = 1, 1e9 do clock:now() end", "for i = 1, 1e9 do os.date() end", "for i = 1, 1e9 do count{} end",
    "table.sort({3, 2, 1, 4}, function() while true do end end)",
    "('x'):gsub('x', function() while true do end end)",
    "table.foreach({1}, function() while true do end end)",
    "for i = 1, 1e9 do config:exists('/x' .. i) end",
    "for i = 1, 1e9 do blackboard:open_for_reading('SpeechSynthInterface', 'x' .. i) end",
]  # fmt: skip


def make(tmp_path: Path, **more: Any) -> Rig:
    rig = Rig()
    rig.lua([write_skills(tmp_path, SKILLS)], space="space", limits=LIMITS, **more)
    return rig


@pytest.fixture
def lua(tmp_path: Path) -> Rig:
    """A Skiller that runs skill strings as Lua, and reports as ``strict`` does."""
    return make(tmp_path, mode="fawkes")


def check_next_skill(rig: Rig) -> None:
    rig.exec("count{}", loops=3)
    assert (rig.status, rig.state.error) == ("S_FINAL", "")


@pytest.mark.parametrize("text", [*TRICKS, *ENDLESS])
def test_hostile_data_are_one_error_with_column_and_mode(tmp_path: Path, text: str):
    rig = make(tmp_path)
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert rig.state.error.startswith(("column ", "line "))
    assert ONLY_FAWKES in rig.state.error
    assert len(rig.logged(Level.ERROR)) == 1
    check_next_skill(rig)


@pytest.mark.parametrize("text", TRICKS)
def test_hostile_lua_fails(lua: Rig, text: str):
    lua.exec(text)
    assert lua.status == "S_FAILED"
    check_next_skill(lua)


@pytest.mark.parametrize("text", ENDLESS)
def test_endless_lua_is_stopped(lua: Rig, text: str):
    lua.exec(text)
    assert lua.status == "S_FAILED"
    assert "endless loop?" in lua.logged(Level.ERROR)[0] or "too many" in lua.logged(Level.ERROR)[0]
    check_next_skill(lua)


@pytest.mark.parametrize(
    "text", ["print_info(('x'):rep(1e6))", "t = t or {}; t[#t + 1] = ('x'):rep(1e6); count{to = 1e9}"]
)
def test_large_texts_and_tables_stay_bounded(lua: Rig, text: str):
    lua.exec(text, loops=100)
    assert all(len(line) <= 8192 for line in lua.logged(Level.INFO))
    assert lua.backends[0].engine._state._lua.get_memory_used() <= LIMITS.memory
    check_next_skill(lua)


HEAD = "module(..., skillenv.module_init)\nname = 'evil'\ndocumentation = 'x'\nskillenv.skill_module(_M)\n"

FOR_EVER = "function() while true do end end"
FINAL = "function execute() return S_FINAL end function reset() end"

HANGS = {
    "__tostring of an error": f"""
        function execute() error(setmetatable({{}}, {{__tostring = {FOR_EVER}}})) end function reset() end""",
    "finalizers, which Lua has for userdata only": f"""
        function execute() for i = 1, 1e9 do setmetatable({{}}, {{__gc = {FOR_EVER}}}) end end
        function reset() end""",
    "reset": f"function execute() return S_RUNNING end reset = {FOR_EVER}",
    "a preloop callback": f"skillenv.add_preloop_callback('x', {FOR_EVER}) {FINAL}",
    "a loop callback": f"skillenv.add_loop_callback('x', {FOR_EVER}) {FINAL}",
    "a finalize callback": f"skillenv.add_finalize_callback('x', {FOR_EVER}) {FINAL}",
    "the fields of a machine": f"""
        fsm = {{exit_state = 'x', reset = function() end}} function reset() end
        function execute() setmetatable(fsm, {{__index = {FOR_EVER}}}) return S_FAILED end""",
    "the text of an error": f"""
        fsm = {{exit_state = 'x', error = setmetatable({{}}, {{__tostring = {FOR_EVER}}})
               , reset = function() end, changed = function() return true end}}
        function execute() return S_FAILED end function reset() end""",
    "the graph": f"""
        fsm = {{exit_state = 'x', error = '', changed = {FOR_EVER}, reset = function() end}}
        function execute() return S_RUNNING end function reset() end""",
    "comparison": f"""
        local mt = {{__eq = {FOR_EVER}}} function reset() end
        function execute() return setmetatable({{}}, mt) == setmetatable({{}}, mt) end""",
    "the result": f"""
        function execute() return setmetatable({{}}, {{__tostring = {FOR_EVER}}}) end function reset() end""",
    "the library": f"skillenv.get_overall_status, skillenv.names = {FOR_EVER}, {FOR_EVER} {FINAL}",
    "a log text": """
        function execute() print(setmetatable({}, {__tostring = function() return {} end})) end
        function reset() end""",
}


@pytest.mark.parametrize("name", HANGS)
def test_hanging_skill_delays_no_loop(tmp_path: Path, name: str):
    """Each call of the host into a skill's code ends."""
    space = SKILLS["space"] + 'skillenv.use_skill("skills.evil")'
    skills = {"space": space, "evil": HEAD + HANGS[name]}
    rig = Rig()
    rig.lua([write_skills(tmp_path, SKILLS | skills)], space="space", limits=LIMITS)
    viewer: Any = rig.board.open_for_reading("SkillerDebugInterface", "Skiller", owner="viewer")
    for graph in ("evil", "LIST", "SKILL_DEP", "ACTIVE"):
        viewer.msgq_enqueue(viewer.SetGraphMessage(graph))
        rig.exec("evil{}", loops=2)
    engine = rig.backends[0].engine
    assert isinstance(engine.find_failure_reason(), str)
    assert set(engine.skills) == {"count", "fail", "done", "evil"}
    assert engine.documentation("evil") == "x"
    rig.exec("done{}")
    assert rig.status in ("S_FINAL", "S_FAILED")  # failed if the skill's own callbacks hang
    rig.backends.pop().close()


def test_only_fawkes_mode_evaluates_and_warns(tmp_path: Path):
    strict, fawkes = make(tmp_path), make(tmp_path, mode="fawkes")
    assert [line for line in strict.logged(Level.WARN) if "evaluates" in line] == []
    assert [line for line in fawkes.logged(Level.WARN) if "evaluates" in line] == [
        "/skiller/mode: fawkes: Skiller evaluates skill strings as Lua, no matter who sends them"
    ]
    for rig, expected in ((strict, []), (fawkes, ["evaluated"])):
        rig.exec("print_info('evaluated')")
        assert [line for line in rig.logged(Level.INFO) if line == "evaluated"] == expected


def test_compile_has_single_caller():
    """All paths to a Lua Skiller end in its message ExecSkill, where the mode decides."""
    callers = [
        (path.name, line.strip())
        for path in module_files().values()
        for line in path.read_text().splitlines()
        if "engine.compile(" in line or '_call("compile"' in line or 'call("compile"' in line
    ]
    assert callers == [
        ("engine.py", 'return self._error_text(self._call("compile", to_lua(skill_string)))'),
        (
            "skiller.py",
            "problem = self.engine.compile(skill_string)",
        ),
    ]
