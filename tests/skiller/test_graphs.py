"""The graphs of SkillerDebugInterface equal the drawings of Fawkes' own Lua files byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.skiller.make import skill_folders
from tests.skiller.fawkes_lua import FawkesLua
from tests.skiller.rig import Rig, write_skills
from tests.support import FAWKES_DIR, needs_fawkes

# Machines with all drawable features, without interfaces.
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


class EnginePair:
    """The same skills in Fawkes' Lua files and in cxbridge's engine."""

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
def pair(tmp_path: Path) -> EnginePair:
    return EnginePair(tmp_path)


@needs_fawkes
@pytest.mark.parametrize(
    ("direction", "coloured"), [("TB", True), ("LR", True), ("BT", False), ("RL", False)]
)
def test_graphs_of_idle_skills_equal(pair: EnginePair, direction: str, coloured: bool):
    for skill in pair.ours.skills:
        ours, theirs = pair.graphs(skill, direction, coloured=coloured)
        assert ours == theirs
        assert f'rankdir="{direction}"' in ours


@needs_fawkes
@pytest.mark.parametrize("coloured", [True, False])
@pytest.mark.parametrize("skill", ["leaf", "nest", "folded"])
def test_graphs_of_running_skill_equal(pair: EnginePair, skill: str, coloured: bool):
    drawings = set()
    for _ in range(4):
        pair.call(f"{skill}{{}}")
        ours, theirs = pair.graphs(skill, "TB", coloured=coloured)
        assert ours == theirs
        assert 'active="true"' in ours
        drawings.add(ours)
    assert len(drawings) > 1


@needs_fawkes
def test_graphs_of_skill_dependencies_equal(pair: EnginePair):
    assert pair.ours.overview("SKILL_DEP") == pair.theirs.dependencies()
