"""The order of a plan-action: its executor and arguments, as far as facts show them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from cxbridge.history.transitions import unquote

PLAN_ACTION: Final = "plan-action"
"""The deftemplate of plan-actions."""

_WORD = re.compile(r'"[^"]*"|[^\s"]+')
_OF_SKILL_STRING = re.compile(r"[^\s{}()=,\"']+")

ActionKey = tuple[str, str, str]
"""The ids of goal, plan and action."""


@dataclass(frozen=True, slots=True)
class ActionOrder:
    """The order of a plan-action.

    :param skiller: the executor, empty if the agent's core has no such slot.
    :param arguments: values of the parameters, strings without quotes.
    """

    skiller: str = ""
    arguments: tuple[str, ...] = ()

    def count_in(self, skill_string: str) -> int:
        """Return the number of arguments that a skill string contains."""
        words = set(_OF_SKILL_STRING.findall(skill_string))
        return sum(value in words for value in self.arguments)


def order_of(slots: Mapping[str, str]) -> tuple[ActionKey, ActionOrder]:
    """Return the key of a plan-action's fact, and its order.

    :param slots: of the fact, as CLIPS prints their values.
    """
    key = slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("id", "")
    return key, ActionOrder(unquote(slots.get("skiller", "")), fields_of(slots.get("param-values", "")))


def fields_of(text: str) -> tuple[str, ...]:
    """Return the fields of a printed multislot, strings without quotes."""
    return tuple(unquote(word) for word in _WORD.findall(text))
