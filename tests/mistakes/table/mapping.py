"""Mistakes in the action mapping."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_FILE: Final = "scenario.yaml"
_ROW: Final = "greet: greet{name=?(who)s}"
_AT: Final = "scenario.yaml:9"

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "the skill is misspelt",
        _FILE,
        _ROW,
        "greet: gret{name=?(who)s}",
        "'greet' is mapped to the skill 'gret', which there is not",
        _AT,
    ),
    mistake(
        "the parameter is misspelt",
        _FILE,
        _ROW,
        "greet: greet{name=?(hwo)s}",
        "'greet' has no parameter 'hwo'",
        _AT,
    ),
    mistake("the action is misspelt", _FILE, _ROW, "greeet: greet{name=?(who)s}", "greet", "", status=3),
    mistake(
        "the mapping is a map",
        _FILE,
        _ROW,
        "greet: {skill: greet}",
        "the mapping of action 'greet' is a map, not a text",
        _AT,
    ),
    mistake(
        "the mapping is a list",
        _FILE,
        _ROW,
        "greet: [greet]",
        "the mapping of action 'greet' is a list, not a text",
        _AT,
    ),
    mistake("a brace is missing", _FILE, _ROW, "greet: greet{name=?(who)s", "", _AT),
    mistake("the argument is misspelt", _FILE, _ROW, "greet: greet{nmae=?(who)s}", "nmae", _AT, status=1),
    mistake("the value is not a number", _FILE, _ROW, "greet: greet{name=?(who)i}", "'ann'", _AT, status=1),
    mistake(
        "the parameters do not match",
        "hello-plan.clp",
        "(param-names who) (param-values ?name)",
        "(param-names who) (param-values)",
        "",
        "",
        status=1,
    ),
)
