"""Skill strings in the usual form, ``name{key=value, ...}`` or ``name(value, ...)``, as values.

A skill string is data: receivers of foreign skill strings parse it with
:func:`cxbridge.skiller.luacalls.read_calls`. Only the Lua Skiller in mode ``fawkes`` evaluates it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cxbridge.errors import SkillError
from cxbridge.skiller.luacalls import LuaCall, read_calls


@dataclass(frozen=True, slots=True)
class SkillStringCall:
    """A call of a skill.

    :param args: arguments by name, or by position from 1.
    """

    name: str
    args: dict[str | int, Any] = field(default_factory=dict)


def parse_skill_string(text: str) -> list[SkillStringCall]:
    """Return the calls in a skill string.

    :raises SkillError: if it does not have the usual form, with line and column.
    """
    calls = read_calls(text)
    if not calls:
        raise SkillError("the skill string has no call of a skill")
    return [_call(call) for call in calls]


def parse_skill_call(text: str) -> SkillStringCall:
    """Return the only call in a skill string.

    :raises SkillError: if it does not have the usual form, or has several calls.
    """
    calls = parse_skill_string(text)
    if len(calls) != 1:
        raise SkillError(f"the skill string '{text}' has {len(calls)} calls, expected one")
    return calls[0]


def _call(call: LuaCall) -> SkillStringCall:
    if len(call.values) == 1 and isinstance(call.values[0], dict):
        return SkillStringCall(call.name, call.values[0])
    return SkillStringCall(call.name, dict(enumerate(call.values, start=1)))
