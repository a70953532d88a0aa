"""The order of a plan-action: who is to execute it, and with which arguments, as far as facts show."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from cxbridge.history.transitions import unquote

PLAN_ACTION: Final = "plan-action"
"""The deftemplate."""

_WORD = re.compile(r'"[^"]*"|[^\s"]+')
_OF_SKILL_STRING = re.compile(r"[^\s{}()=,\"']+")

ActionKey = tuple[str, str, str]
"""Ids of goal, plan and action."""


@dataclass(frozen=True, slots=True)
class ActionOrder:
    """The order that a plan-action gives.

    :param skiller: who is to execute it; empty when the agent's core knows no such slot.
    :param arguments: the values of its parameters, strings without quotes.
    """

    skiller: str = ""
    arguments: tuple[str, ...] = ()

    def count_in(self, skill_string: str) -> int:
        """Return how many of the arguments a skill string has."""
        words = set(_OF_SKILL_STRING.findall(skill_string))
        return sum(value in words for value in self.arguments)


def order_of(slots: Mapping[str, str]) -> tuple[ActionKey, ActionOrder]:
    """Return the plan-action of a fact, and its order.

    :param slots: of the fact, as CLIPS prints their values.
    """
    key = slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("id", "")
    return key, ActionOrder(unquote(slots.get("skiller", "")), fields_of(slots.get("param-values", "")))


def fields_of(text: str) -> tuple[str, ...]:
    """Return the fields of a multislot as CLIPS prints them, strings without quotes."""
    return tuple(unquote(word) for word in _WORD.findall(text))
