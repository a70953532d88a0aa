"""Mistakes in Lua skills."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_SKILL: Final = "skills/skills/hello/greet.lua"
_SPACE: Final = "skills/skills/hello.lua"
_GOES_ON: Final = 0
"""As in Fawkes: a state whose init fails is left all the same."""

_FAILED: Final = 1

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "an end is missing",
        _SKILL,
        "self.fsm.vars.name\nend",
        "self.fsm.vars.name\n",
        "'end' expected",
        "greet.lua:25",
    ),
    mistake(
        "a comma is missing",
        _SKILL,
        'name=name, start="START"',
        'name=name start="START"',
        "near 'start'",
        "greet.lua:4",
    ),
    mistake(
        "a bracket of a text never closes", _SKILL, "]==]", "]]", "unfinished long string", "greet.lua:25"
    ),
    mistake(
        "a function is misspelt as the file loads",
        _SKILL,
        "skillenv.skill_module",
        "skillenv.skill_modul",
        "skill_modul",
        "greet.lua:12",
    ),
    mistake(
        "a skill of the space is misspelt",
        _SPACE,
        "skills.hello.greet",
        "skills.hello.great",
        "skills.hello.great",
        "hello.lua:3",
    ),
    mistake(
        "a transition leads to a state that does not exist",
        _SKILL,
        '"FINAL", cond=true',
        '"FINISH", cond=true',
        "FINISH",
        "greet.lua:18",
    ),
    mistake(
        "a condition does not compile", _SKILL, "cond=true", 'cond="1 +"', "unexpected symbol", "greet.lua:18"
    ),
    mistake(
        "an interface is misspelt",
        _SKILL,
        "depends_interfaces = {}",
        'depends_interfaces = {{v="eye", type="HeloInterface", id="eye"}}',
        "HeloInterface",
        "greet.lua:12",
    ),
    mistake(
        "a variable is misspelt in a state",
        _SKILL,
        "self.fsm.vars.name\nend",
        "self.fsm.vras.name\nend",
        "'vras'",
        "greet.lua:23",
        status=_GOES_ON,
    ),
    mistake(
        "a function is misspelt in a state",
        _SKILL,
        "  self.fsm.vars.text",
        "  self.fsm.vars.text = gret()\n  self.fsm.vars.text",
        "'gret'",
        "greet.lua:23",
        status=_GOES_ON,
    ),
    mistake(
        "an error ends a condition",
        _SKILL,
        "cond=true",
        'cond="vars.name.first > 1"',
        "condition 'vars.name.first > 1'",
        "greet.lua:18",
        status=_FAILED,
    ),
    mistake(
        "the start is a state that does not exist",
        _SKILL,
        'start="START"',
        'start="STRAT"',
        "mapped at agent/scenario.yaml:9.*STRAT",
        "greet.lua:4",
        status=_FAILED,
    ),
    mistake(
        "the name of the skill is not that of the file",
        _SKILL,
        'name = "greet"',
        'name = "gret"',
        "greet",
        "scenario.yaml:9",
    ),
)
