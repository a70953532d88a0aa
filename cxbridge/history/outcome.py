"""The outcomes of goals, actions and skills in six words, each with an icon and a colour.

Terminals, pages and reports derive from these tables. No outcome rests on its colour alone.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, Final


class OutcomeKind(Enum):
    """What became of a goal, a plan-action or a skill call.

    :ivar word: what readers see.
    :ivar icon: one character.
    :ivar colour: a colour's name, as terminals have them; empty: the terminal's own.
    :ivar tone: its colour in pages, as base.css names it.
    """

    FORMULATED = "waiting", "○", "", "new"
    RUNNING = "running", "▶", "cyan", "active"
    COMPLETED = "completed", "✓", "green", "done"
    FAILED = "failed", "✗", "red", "failed"
    REJECTED = "rejected", "⊘", "yellow", "refused"
    RETRACTED = "retracted", "·", "", "gone"

    def __init__(self, word: str, icon: str, colour: str, tone: str) -> None:
        self.word = word
        self.icon = icon
        self.colour = colour
        self.tone = tone


LEGEND: Final = " ".join(f"{outcome.icon} {outcome.word}" for outcome in OutcomeKind)
"""The meanings of the icons."""

ENDED_MODES: Final = ("FINISHED", "EVALUATED", "RETRACTED")
"""Modes of a goal that has an outcome."""

_OF_GOAL: Final = {
    "COMPLETED": OutcomeKind.COMPLETED,
    "FAILED": OutcomeKind.FAILED,
    "REJECTED": OutcomeKind.REJECTED,
}

_OF_ACTION: Final = {
    "FORMULATED": OutcomeKind.FORMULATED,
    "PENDING": OutcomeKind.FORMULATED,
    "WAITING": OutcomeKind.FORMULATED,
    "FINAL": OutcomeKind.COMPLETED,
    "EXECUTION-FAILED": OutcomeKind.FAILED,
    "FAILED": OutcomeKind.FAILED,
}

_OF_SKILL: Final = {
    "S_RUNNING": OutcomeKind.RUNNING,
    "S_FINAL": OutcomeKind.COMPLETED,
    "S_FAILED": OutcomeKind.FAILED,
    "stopped": OutcomeKind.RETRACTED,
}


def goal_outcome(mode: str, outcome: str) -> OutcomeKind:
    """Return what became of a goal, by its slots ``mode`` and ``outcome``."""
    if mode in ENDED_MODES:
        return _OF_GOAL.get(outcome, OutcomeKind.RETRACTED)
    return OutcomeKind.RUNNING if mode == "DISPATCHED" else OutcomeKind.FORMULATED


def action_outcome(state: str) -> OutcomeKind:
    """Return what became of a plan-action. Waiting for its effects is a part of running it."""
    return _OF_ACTION.get(state, OutcomeKind.RUNNING)


def skill_outcome(status: str) -> OutcomeKind:
    """Return what became of a skill call, by the status that its Skiller reports."""
    return _OF_SKILL.get(status, OutcomeKind.FORMULATED)


def plain_outcomes() -> dict[str, Any]:
    """Return the outcomes, and which states have which, as JSON for pages."""
    states = {"goal": _OF_GOAL, "action": _OF_ACTION, "skill": _OF_SKILL}
    return {
        "kinds": {
            kind.name.lower(): {"word": kind.word, "icon": kind.icon, "tone": kind.tone}
            for kind in OutcomeKind
        },
        "ended": ENDED_MODES,
        **{of: {state: kind.name.lower() for state, kind in table.items()} for of, table in states.items()},
    }
