"""The graphs of SkillerDebugInterface: byte for byte those that Fawkes' own Lua files draw."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.skiller.make import skill_folders
from tests.skiller.fawkes_lua import FawkesLua
from tests.skiller.rig import Rig, write_skills
from tests.support import FAWKES_DIR, needs_fawkes

# Machines with everything that a drawing can show, and no interface.
MACHINES = {
    "leaf": """
module(..., skillenv.module_init)
name = "leaf"
fsm = SkillHSM:new{name = name, start = "FIRST", dotattr = {fontsize = "9", label = 'a "leaf"'}}
documentation = "Goes on by one state a loop, and round once."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M,
    "FIRST", {"SECOND", JumpState, dotattr = {comment = "the middle", shape = "box"}},
    {"odd name", JumpState},
    {"THIRD", JumpState, dotattr = {comment = "x", label = "three"}}}
fsm:add_transitions{
    {"FIRST", "SECOND", cond = "vars.n == 1 or vars.n == 3", desc = "on\\nin two lines"},
    {"SECOND", "FIRST", cond = "vars.n == 2", desc = 'back to "FIRST"',
        dotattr = {weight = "2", style = "bold"}},
    {"SECOND", "THIRD", timeout = 1000, desc = "slow"},
    {"SECOND", "odd name", cond = "vars.n > 9"},
    {"odd name", "FAILED", cond = true, error = "odd", desc = "a\\\\lb"},
    {"THIRD", "FINAL", cond = function(state) return false end, hide = true},
    {"THIRD", "FINAL", cond = "vars.done", precond = "vars.ready"},
    {"FAILED", "FIRST", cond = false or "false", desc = "again"},
}
function FIRST:loop() fsm.vars.n = (fsm.vars.n or 0) + 1 end
function SECOND:loop() fsm.vars.n = fsm.vars.n + 1 end
""",
    "nest": """
module(..., skillenv.module_init)
name = "nest"
fsm = SkillHSM:new{name = name, start = "IN"}
depends_skills = {"leaf"}
documentation = "A machine in a machine in a machine, and a sub-skill."
skillenv.skill_module(_M)
local function inner(label, start)
    local made = SkillHSM:new{name = label, start = start}
    return made
end
local deep = inner("deep", "D1")
deep:define_states{"D1", "D2"}
deep:add_transitions{{"D1", "D2", cond = true, desc = "down"}, {"D2", "FINAL", cond = "vars.n == 2"}}
deep.states.D2.loop = function(self) self.fsm.vars.n = (self.fsm.vars.n or 0) + 1 end
local mid = inner("mid", "M1")
mid:define_states{"M1", {"M2", SubFSMJumpState, subfsm = deep, exit_to = "FINAL", fail_to = "FAILED"}}
mid:add_transitions{{"M1", "M2", cond = true}}
fsm:define_states{export_to = _M,
    {"IN", SubFSMJumpState, subfsm = mid, exit_to = "SUB", fail_to = "FAILED"},
    {"SUB", SkillJumpState, skills = {{leaf}}, final_to = "FINAL", fail_to = "FAILED"}}
""",
    "folded": """
module(..., skillenv.module_init)
name = "folded"
fsm = SkillHSM:new{name = name, start = "A", graph_collapse = true, recover_state = "R"}
documentation = "Shows its ends only."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "A", "B", "R"}
fsm:add_transitions{{"A", "B", cond = "false"}, {"A", "R", cond = "vars.n == 2"}, {"B", "FINAL", cond = true}}
function A:loop() fsm.vars.n = (fsm.vars.n or 0) + 1 end
""",
}
GENERIC = ["say", "fake_relmoveto", "fake_moveto", "back_off", "align_laserht", "spin", "transrot", "turn"]
SPACE = "require('fawkes.modinit') module(..., fawkes.modinit.register_all)\n"


class Both:
    """The same skills in Fawkes' Lua files and in our engine."""

    def __init__(self, folder: Path) -> None:
        assert FAWKES_DIR is not None
        generic = [f"skills.generic.{name}" for name in GENERIC]
        modules = [*generic, *(f"skills.{name}" for name in MACHINES)]
        space = SPACE + "".join(f"skillenv.use_skill('{name}')\n" for name in modules)
        write_skills(folder, {**MACHINES, "space": space})
        self.theirs = FawkesLua(FAWKES_DIR)
        for name in modules:
            last = name.rpartition(".")[2]
            in_fawkes = FAWKES_DIR / "src" / "lua" / "skills" / "generic" / f"{last}.lua"
            self.theirs.use(name, in_fawkes if name in generic else folder / f"{last}.lua")
        rig = Rig([FAWKES_DIR / "src" / "libs" / "interfaces"])
        self.ours = rig.lua(skill_folders([folder], FAWKES_DIR), space="space").engine

    def call(self, text: str) -> None:
        self.theirs.call(text)
        assert self.ours.compile(text) == ""
        assert self.ours.run()[0] == ""

    def graphs(self, skill: str, direction: str, *, coloured: bool) -> tuple[str, str]:
        found, graph = self.ours.draw_graph(skill, direction, coloured=coloured, redraw=True)
        assert found
        return graph, self.theirs.graph(skill, direction, coloured=coloured)


@pytest.fixture
def both(tmp_path: Path) -> Both:
    return Both(tmp_path)


@needs_fawkes
@pytest.mark.parametrize(
    ("direction", "coloured"), [("TB", True), ("LR", True), ("BT", False), ("RL", False)]
)
def test_every_skill_at_rest(both: Both, direction: str, coloured: bool):
    for skill in both.ours.skills:
        ours, theirs = both.graphs(skill, direction, coloured=coloured)
        assert ours == theirs
        assert f'rankdir="{direction}"' in ours


@needs_fawkes
@pytest.mark.parametrize("coloured", [True, False])
@pytest.mark.parametrize("skill", ["leaf", "nest", "folded"])
def test_the_way_of_a_running_skill(both: Both, skill: str, coloured: bool):
    seen = set()
    for _ in range(4):
        both.call(f"{skill}{{}}")
        ours, theirs = both.graphs(skill, "TB", coloured=coloured)
        assert ours == theirs
        assert 'active="true"' in ours
        seen.add(ours)
    assert len(seen) > 1


@needs_fawkes
def test_who_uses_whom(both: Both):
    assert both.ours.overview("SKILL_DEP") == both.theirs.dependencies()
