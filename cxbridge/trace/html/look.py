"""The icons, words and colours of states: each state has all three, never a colour alone.

A tone is a CSS class, ``t-done`` and so on; base.css gives it a colour in light, dark and print.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Look:
    """How one state looks.

    :param tone: the CSS class without ``t-``.
    :param icon: one character.
    """

    tone: str
    icon: str


MODES: Mapping[str, Look] = {
    "FORMULATED": Look("new", "○"),
    "SELECTED": Look("chosen", "◔"),
    "EXPANDED": Look("planned", "◑"),
    "COMMITTED": Look("bound", "◕"),
    "DISPATCHED": Look("active", "▶"),
    "FINISHED": Look("ended", "■"),
    "EVALUATED": Look("ended", "◼"),
    "RETRACTED": Look("gone", "·"),
}
"""The modes of a goal, in the order of its life."""

OUTCOMES: Mapping[str, Look] = {
    "COMPLETED": Look("done", "✓"),
    "FAILED": Look("failed", "✗"),
    "REJECTED": Look("refused", "⊘"),
}
"""The outcomes of a goal, but UNKNOWN; from FINISHED on they say more than the mode."""

ACTION_STATES: Mapping[str, Look] = {
    "FORMULATED": Look("new", "○"),
    "PENDING": Look("chosen", "◔"),
    "WAITING": Look("planned", "◑"),
    "RUNNING": Look("active", "▶"),
    "EXECUTION-SUCCEEDED": Look("done", "✓"),
    "SENSED-EFFECTS-WAIT": Look("bound", "◕"),
    "SENSED-EFFECTS-HOLD": Look("bound", "◕"),
    "EFFECTS-APPLIED": Look("done", "✓"),
    "FINAL": Look("done", "✓"),
    "EXECUTION-FAILED": Look("failed", "✗"),
    "FAILED": Look("failed", "✗"),
}
"""The states of a plan-action."""

SKILL_STATES: Mapping[str, Look] = {
    "S_INACTIVE": Look("new", "○"),
    "S_RUNNING": Look("active", "▶"),
    "S_FINAL": Look("done", "✓"),
    "S_FAILED": Look("failed", "✗"),
    "stopped": Look("refused", "⊘"),
}
"""The states of a skill; ``stopped`` is one that another skill followed before it said how it ended."""

OTHER = Look("other", "?")
"""A state that is in no list: agents may have their own."""

ENDED = frozenset({"FINISHED", "EVALUATED", "RETRACTED"})
"""Modes in which a goal's outcome decides its look, when it has one."""


def goal_look(mode: str, outcome: str) -> Look:
    """Return how a goal looks."""
    look = OUTCOMES.get(outcome)
    if look is not None and mode in ENDED:
        return look
    return MODES.get(mode, OTHER)


def plain_looks() -> dict[str, dict[str, list[str]]]:
    """Return all looks as values that JSON knows: kind, state, then tone and icon."""
    tables = {"mode": MODES, "outcome": OUTCOMES, "action": ACTION_STATES, "skill": SKILL_STATES}
    return {
        kind: {state: [look.tone, look.icon] for state, look in table.items()}
        for kind, table in tables.items()
    }
