"""The check reads the skills of a skill space from the texts of its files."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.interfaces.registry import default_registry
from cxbridge.lua_syntax import LuaCompiler
from cxbridge.skiller.make import make_lua_skiller
from cxbridge_studio.check.skill_spaces import find_space_skills
from tests.support import ROOT

SKILL = """module(..., skillenv.module_init)
name = '{0}'
fsm = SkillHSM:new{{name = name, start = "A"}}
documentation = [==[Nothing.]==]
skillenv.skill_module(_M)
fsm:define_states{{export_to = _M, "A"}}
fsm:add_transitions{{{{"A", "FINAL", cond = true}}}}
"""
HEAD = 'require("fawkes.modinit")\nmodule(..., fawkes.modinit.register_all)\n'
KNOWN = {
    "separate calls": 'skillenv.use_skill("skills.a")\nskillenv.use_skill("skills.b")\n',
    "a loop": 'for _, each in ipairs {"a", "b"} do skillenv.use_skill("skills." .. each) end\n',
    "comments": """-- skillenv.use_skill("skills.c")
        --[[ use_skill("x") ]] skillenv.use_skill("skills.a")
        local text = "-- no comment" """,
    "both": """skillenv.use_skill("skills.c")
        for _, x in ipairs({"a"}) do skillenv.use_skill("skills." .. x) end""",
}
COMPUTED = {
    "a computed second name": 'local x = "skills.b"\nskillenv.use_skill("skills.a")\nskillenv.use_skill(x)\n',
    "a name": 'local x = "skills.a"\nskillenv.use_skill(x)\n',
    "a condition": 'skillenv.use_skill("skills." .. (config and "a" or "b"))\n',
    "a function in a variable": 'local use = skillenv.use_skill\nuse("skills.a")\n',
    "nothing": "",
}
WRONG = {
    "no such skill": 'skillenv.use_skill("skills.d")\n',
    "no such skill in a loop": 'for _, x in ipairs {"d"} do skillenv.use_skill("skills." .. x) end\n',
    "no Lua": "this is no Lua\n",
    "a skill twice": 'skillenv.use_skill("skills.a")\nskillenv.use_skill("skills.a2")\n',
    "a broken skill": 'skillenv.use_skill("skills.broken")\n',
    "a compiled skill": 'skillenv.use_skill("skills.compiled")\n',
}


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    for name in "abc":
        (tmp_path / f"{name}.lua").write_text(SKILL.format(name))
    (tmp_path / "a2.lua").write_text(SKILL.format("a"))
    (tmp_path / "broken.lua").write_text("name = \n")
    (tmp_path / "compiled.lua").write_bytes(b"\x1bLuaQ")
    return tmp_path


def load_skill_names(space: str, folder: Path) -> frozenset[str]:
    """Return the skills that the engine loads."""
    bus = EventBus(VirtualClock())
    board = LocalBlackBoard(default_registry(), bus.clock, bus)
    with make_lua_skiller(board, bus.clock, bus, folders=[folder], space=space) as skiller:
        return frozenset(skiller.skills)


@pytest.mark.parametrize("text", KNOWN.values(), ids=KNOWN)
def test_found_skills_equal_skills_of_engine(folder, text):
    (folder / "mine.lua").write_text(HEAD + text)
    skills = find_space_skills("mine", [folder], LuaCompiler())
    assert skills
    assert skills.keys() == load_skill_names("mine", folder)
    assert all(path.is_file() for path in skills.values())


@pytest.mark.parametrize("space", ["test", "mobile"])
def test_skills_of_shipped_spaces_equal_skills_of_engine(space):
    folder = ROOT / "luaskills"
    skills = find_space_skills(space, [folder], LuaCompiler())
    assert skills is not None
    assert skills.keys() == load_skill_names(space, folder)


@pytest.mark.parametrize("text", COMPUTED.values(), ids=COMPUTED)
def test_computed_skills_are_unknown(folder, text):
    (folder / "mine.lua").write_text(HEAD + text)
    assert find_space_skills("mine", [folder], LuaCompiler()) is None


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_space_refused_by_engine_is_refused(folder, text):
    (folder / "mine.lua").write_text(HEAD + text)
    with pytest.raises(SkillError) as caught:
        find_space_skills("mine", [folder], LuaCompiler())
    assert caught.value.file is not None
    with pytest.raises(SkillError):
        load_skill_names("mine", folder)
