"""The meaning of skill strings, by section 4 of the facts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.events import Level
from tests.skiller.rig import Rig, write_skills

SKILLS = {
    "space": """
require("fawkes.modinit")
module(..., fawkes.modinit.register_all)
for _, skill in ipairs {"tell", "final", "fickle"} do skillenv.use_skill("skills." .. skill) end
""",
    "tell": """
module(..., skillenv.module_init)
name = "tell"
fsm = SkillHSM:new{name = name, start = "TELL"}
documentation = "Tells its arguments, and is final in its loop number loops."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "TELL"}
fsm:add_transitions{{"TELL", "FINAL", cond = "vars.n >= (vars.loops or vars[2] or 1)"}}
function TELL:init() fsm.vars.n = 0 end
function TELL:loop()
    local vars = fsm.vars
    vars.n = vars.n + 1
    print_info("%s %d", vars.what or vars[1] or "nothing", vars.n)
end
""",
    "final": """
module(..., skillenv.module_init)
name = "final"
documentation = "Final at once, and tells each call."
skillenv.skill_module(_M)
function execute() print_info("called") return S_FINAL end
function reset() end
""",
    "fickle": """
module(..., skillenv.module_init)
name = "fickle"
documentation = "Final in its first call, running later."
skillenv.skill_module(_M)
local calls = 0
function execute() calls = calls + 1 return calls == 1 and S_FINAL or S_RUNNING end
function reset() calls = 0 end
""",
}


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return make(tmp_path)


@pytest.fixture
def lua(tmp_path: Path) -> Rig:
    """A Skiller that runs skill strings as Lua in the mode ``fawkes``."""
    return make(tmp_path, mode="fawkes")


def make(tmp_path: Path, **more: Any) -> Rig:
    rig = Rig()
    rig.lua([write_skills(tmp_path, SKILLS)], space="space", **more)
    rig.loop()
    rig.forget()
    return rig


def printed_texts(rig: Rig) -> list[str]:
    return [text for text in rig.logged(Level.INFO) if "execut" not in text]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('tell{what="named"}', "named 1"),
        ('tell("first", 1)', "first 1"),
        ("tell{}", "nothing 1"),
        ("tell()", "nothing 1"),
        ("tell{'first'}", "first 1"),
    ],
)
def test_skill_gets_named_and_positional_arguments(rig: Rig, text: str, expected: str):
    rig.exec(text)
    assert printed_texts(rig) == [expected]
    assert rig.status == "S_FINAL"


def test_skill_keeps_arguments_of_first_call(lua: Rig):
    lua.exec('k = (k or 0) + 1; tell{what="call " .. k, loops=3}', loops=4)
    assert printed_texts(lua) == ["call 1 1", "call 1 2", "call 1 3"]


def test_calls_run_in_parallel_and_all_must_be_final(rig: Rig):
    rig.exec('tell{what="a", loops=3}; final{}')
    assert (printed_texts(rig), rig.status) == (["a 1", "called"], "S_RUNNING")
    rig.loop(2)
    assert rig.status == "S_FINAL"


def test_call_may_depend_on_status_of_earlier_call(lua: Rig):
    lua.exec('if tell{what="a", loops=2} == S_FINAL then final{} end', loops=4)
    assert printed_texts(lua) == ["a 1", "a 2", "called"]
    assert lua.status == "S_FINAL"


def test_final_skill_must_stay_final(rig: Rig):
    rig.exec("fickle{} tell{loops=3}", loops=5)
    assert rig.status == "S_RUNNING"
