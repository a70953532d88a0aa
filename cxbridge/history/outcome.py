"""The outcomes of goals, actions and skills in six words, each with an icon and a colour.

The page has the same words and icons (js/outcome.js). No outcome rests on its colour alone.
"""

from __future__ import annotations

from enum import Enum
from typing import Final


class OutcomeKind(Enum):
    """What became of a goal, a plan-action or a skill call.

    :ivar word: what readers see.
    :ivar icon: one character.
    :ivar colour: a colour's name, as terminals have them; empty: the terminal's own.
    """

    FORMULATED = "waiting", "○", ""
    RUNNING = "running", "▶", "cyan"
    COMPLETED = "completed", "✓", "green"
    FAILED = "failed", "✗", "red"
    REJECTED = "rejected", "⊘", "yellow"
    RETRACTED = "retracted", "·", ""

    def __init__(self, word: str, icon: str, colour: str) -> None:
        self.word = word
        self.icon = icon
        self.colour = colour


LEGEND: Final = " ".join(f"{outcome.icon} {outcome.word}" for outcome in OutcomeKind)
"""What the icons mean."""

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
