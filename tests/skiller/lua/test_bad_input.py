"""Bad input to skills: each kind fails once, and the Skiller accepts the next skill string."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import SkillError
from cxbridge.events import Level
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.lua.limits import MEBIBYTE, Limits
from tests.skiller.rig import SKILLS, Rig, write_skills

HEAD = "module(..., skillenv.module_init)\n"

EXTRA_SKILLS = {
    "space": SKILLS["space"]
    + 'for _, s in ipairs {"ring", "echo"} do skillenv.use_skill("skills." .. s) end\n',
    # The state runs the skill itself, which did not exist yet when the file named it.
    "ring": HEAD
    + """
name = "ring"
fsm = SkillHSM:new{name = name, start = "ROUND"}
documentation = "Runs itself."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "ROUND"}
function ROUND:loop() return skillenv.get_skill_module("ring").execute() end
""",
    "echo": HEAD
    + """
name = "echo"
fsm = SkillHSM:new{name = name, start = "BEGIN"}
depends_interfaces = {{v = "out", type = "SpeechSynthInterface", id = "Echo", writing = true}}
documentation = "Writes a text to an interface."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "BEGIN", "SAY"}
fsm:add_transitions{{"BEGIN", "SAY", cond = true}, {"SAY", "FINAL", cond = true}}
function SAY:init() out:set_text(fsm.vars.text) end
""",
}


def make(tmp_path: Path, *, mode: Mode = "strict") -> Rig:
    rig = Rig()
    limits = Limits(instructions_per_loop=400_000, seconds_per_loop=10, memory=24 * MEBIBYTE)
    rig.lua([write_skills(tmp_path, SKILLS | EXTRA_SKILLS)], space="space", limits=limits, mode=mode)
    return rig


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return make(tmp_path)


@pytest.fixture
def lua(tmp_path: Path) -> Rig:
    """A Skiller that runs skill strings as Lua."""
    return make(tmp_path, mode="fawkes")


def run_failing(rig: Rig, text: str) -> str:
    """Run a skill string that must fail, and a good skill string after it; return the published error."""
    rig.exec(text)
    assert rig.status == "S_FAILED"
    error: str = rig.state.error
    assert error
    rig.exec("count{}", loops=3)
    assert rig.status == "S_FINAL"
    return error


def echoed_text(rig: Rig) -> str:
    listener: Any = rig.board.open_for_reading("SpeechSynthInterface", "Echo", owner="test")
    listener.read()
    text: str = listener.text
    rig.board.close(listener)
    return text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("echo{text={}}", "text of type string cannot be"),
        ("count{to='many'}", "attempt to compare"),
        ("count{to={}}", "attempt to compare"),
    ],
)
def test_wrong_argument_types_are_logged(rig: Rig, text: str, message: str):
    run_failing(rig, text)
    assert any(message in line for line in rig.logged(Level.ERROR) + rig.logged(Level.WARN))


def test_recursive_skill_fails(rig: Rig):
    error = run_failing(rig, "ring{}")
    assert "stack overflow" in error or "endless loop?" in error


def test_require_of_foreign_module_fails(lua: Rig, tmp_path: Path):
    assert "attempt to call global 'require'" in run_failing(lua, "require('socket')")
    for name, problem in (
        ("socket", "module 'socket' not found"),
        ("../../etc/passwd", "is not the name of a"),
    ):
        write_skills(tmp_path, {"space": f'require("{name}")'})
        with pytest.raises(SkillError, match=problem):
            Rig().lua([tmp_path], space="space")


def test_string_longer_than_field_is_cut(lua: Rig):
    """Fawkes cuts as well."""
    lua.exec("echo{text=('x'):rep(5000)}")
    assert lua.status == "S_FINAL"
    assert len(echoed_text(lua)) in (1023, 1024)
