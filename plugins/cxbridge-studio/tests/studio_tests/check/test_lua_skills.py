"""Mistakes in the text of a Lua skill that prevent a run or the call of a method."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.interfaces.registry import default_registry
from cxbridge.resources import shipped_dir
from cxbridge.skiller.lua import engine
from cxbridge.skiller.make import make_lua_skiller
from cxbridge_studio.check.lua_skills import INTERFACE_METHODS, find_load_mistakes, find_unknown_methods

SKILL = """module(..., skillenv.module_init)
name = "say"
fsm = SkillHSM:new {name = name, start = "CHECK"}
depends_interfaces = {{v = "speech", type = "SpeechSynthInterface", id = "Speech"}}
documentation = [==[Say: speech:nothing() and {"NOWHERE", "FINAL"} are no code here.]==]
skillenv.skill_module(_M)
-- speech:nothing()
function is_said() if speech:is_final() then return true end end
fsm:define_states {export_to = _M, closure = {speech = speech}, "CHECK", {"SAY", JumpState, x = 1}}
fsm:add_transitions {
    {"CHECK", "SAY", cond = "speech:has_writer()", desc = "not speech:nothing()"},
    {"SAY", "FINAL", cond = function() local a, b = 1, 2 return is_said() end},
    {"SAY", "FAILED", timeout = {time = 5, to = "FAILED"}},
}
function SAY:init() speech:msgq_enqueue(speech.SayMessage:new(self.fsm.vars.text)) end
"""
BROKEN = {
    "the type of an interface": (
        '"SpeechSynthInterface"',
        '"SpechSynthInterface"',
        4,
        "SpeechSynthInterface",
    ),
}
UNKNOWN = {
    "in code": ("speech:is_final", "speech:is_finl", 8),
    "in a condition": ("speech:has_writer", "speech:has_writr", 11),
}
COMPUTED = {
    "a type": ('"SpeechSynthInterface"', "TYPE"),
    "another variable": (
        "function is_said() if speech:is_final()",
        "function is_said(speech) if speech:said()",
    ),
}


def find_mistakes(text: str) -> list[tuple[int, str]]:
    schema = default_registry().schema
    mistakes = [*find_load_mistakes(text, schema), *find_unknown_methods(text, schema)]
    return [(text.count("\n", 0, offset) + 1, hint) for offset, _, hint in mistakes]


def test_correct_skill_has_no_finding():
    assert find_mistakes(SKILL) == []


@pytest.mark.parametrize(
    "path", sorted(shipped_dir("luaskills").rglob("*/*.lua")), ids=lambda path: path.stem
)
def test_shipped_skills_have_no_findings(path):
    assert find_mistakes(path.read_text()) == []


@pytest.mark.parametrize(("good", "bad", "line", "hint"), BROKEN.values(), ids=BROKEN)
def test_misspelt_name_is_found_at_its_line(good, bad, line, hint):
    assert SKILL.count(good) == 1
    ((found_line, found_hint),) = find_mistakes(SKILL.replace(good, bad))
    assert (found_line, hint in found_hint) == (line, True)


@pytest.mark.parametrize(("good", "bad", "line"), UNKNOWN.values(), ids=UNKNOWN)
def test_unknown_method_is_found_at_its_line(good, bad, line):
    assert [found_line for found_line, _ in find_mistakes(SKILL.replace(good, bad))] == [line]


@pytest.mark.parametrize(("good", "bad"), COMPUTED.values(), ids=COMPUTED)
def test_computed_name_has_no_finding(good, bad):
    assert good in SKILL
    assert find_mistakes(SKILL.replace(good, bad)) == []


def test_empty_file_is_reported():
    ((_, message, _),) = find_load_mistakes("-- nothing yet\n")
    assert message == "the file is empty, so there is no skill"


def test_engine_reports_empty_file(tmp_path):
    (tmp_path / "mine.lua").write_text('module(..., package.seeall)\nskillenv.use_skill("skills.empty")\n')
    (tmp_path / "empty.lua").write_text("")
    bus = EventBus(VirtualClock())
    board = LocalBlackBoard(default_registry(), bus.clock, bus)
    with pytest.raises(SkillError, match="is no module: its file is empty"):
        make_lua_skiller(board, bus.clock, bus, folders=[tmp_path], space="mine")


def test_interface_methods_equal_methods_of_engine():
    text = Path(engine.__file__).with_name("interfaces.lua").read_text()
    methods = set(re.findall(r"function (?:methods|class):(\w+)", text)) | {"msgq_enqueue_copy"}
    (properties,) = re.findall(r"for _, property in ipairs \{(.*?)\}", text, re.DOTALL)
    assert methods - {"new"} | set(re.findall(r"\w+", properties)) == INTERFACE_METHODS
