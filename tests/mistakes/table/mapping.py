"""Mistakes in the action mapping."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_FILE: Final = "scenario.yaml"
_ROW: Final = "greet: greet{name=?(who)s}"
_AT: Final = "scenario.yaml:9"
_GOES_ON: Final = 0
_FAILED: Final = 1

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake("the skill is misspelt", _FILE, _ROW, "greet: gret{name=?(who)s}", "'gret'", _AT),
    mistake("the parameter is misspelt", _FILE, _ROW, "greet: greet{name=?(hwo)s}", "'hwo'", _AT),
    mistake("the mapping is a map", _FILE, _ROW, "greet: {skill: greet}", "must be a string, not a map", _AT),
    mistake("the mapping is a list", _FILE, _ROW, "greet: [greet]", "must be a string, not a list", _AT),
    mistake("a brace is missing", _FILE, _ROW, "greet: greet{name=?(who)s", "the skill string ends", _AT),
    mistake(
        "the placeholder lacks its type",
        _FILE,
        _ROW,
        "greet: greet{name=?(who)}",
        "the skill string of 'greet' is wrong",
        _AT,
    ),
    mistake(
        "a text has no quotes",
        _FILE,
        _ROW,
        "greet: greet{name=hello you}",
        "the skill string of 'greet' is wrong",
        _AT,
    ),
    mistake(
        "the action is misspelt",
        _FILE,
        _ROW,
        "greeet: greet{name=?(who)s}",
        "lacks the action 'greet'; is 'greeet' meant",
        _AT,
        status=_FAILED,
    ),
    mistake(
        "the argument is misspelt",
        _FILE,
        _ROW,
        "greet: greet{nmae=?(who)s}",
        "field 'name' \\(a nil value\\)",
        "greet.lua:23",
        status=_GOES_ON,
    ),
    mistake(
        "the value is not a number",
        _FILE,
        _ROW,
        "greet: greet{name=?(who)i}",
        "'ann' to integer",
        _AT,
        status=_FAILED,
    ),
    mistake(
        "there are more names than values",
        "hello-plan.clp",
        "(param-names who) (param-values ?name)",
        "(param-names who) (param-values)",
        "Number of parameter names and values",
        "hello-plan.clp:6",
        status=_FAILED,
    ),
)
