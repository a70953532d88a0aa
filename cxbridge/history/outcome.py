"""The six outcomes of goals, actions and skills, each with a word, an icon and a colour.

Terminals, pages and reports use these tables. The colour is never the only distinction.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, Final


class OutcomeKind(Enum):
    """The outcome of a goal, a plan-action or a skill call.

    :ivar word: the word for users.
    :ivar icon: one character.
    :ivar colour: the colour in terminals; empty: the default colour.
    :ivar tone: the name of the colour in base.css.
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


LEGEND: Final = " ".join(f"{kind.icon} {kind.word}" for kind in OutcomeKind)
"""The meanings of the icons."""

ENDED_MODES: Final = ("FINISHED", "EVALUATED", "RETRACTED")
"""The modes in which a goal has an outcome."""

_GOAL_OUTCOMES: Final = {
    "COMPLETED": OutcomeKind.COMPLETED,
    "FAILED": OutcomeKind.FAILED,
    "REJECTED": OutcomeKind.REJECTED,
}

_ACTION_OUTCOMES: Final = {
    "FORMULATED": OutcomeKind.FORMULATED,
    "PENDING": OutcomeKind.FORMULATED,
    "WAITING": OutcomeKind.FORMULATED,
    "FINAL": OutcomeKind.COMPLETED,
    "EXECUTION-FAILED": OutcomeKind.FAILED,
    "FAILED": OutcomeKind.FAILED,
}

_SKILL_OUTCOMES: Final = {
    "S_RUNNING": OutcomeKind.RUNNING,
    "S_FINAL": OutcomeKind.COMPLETED,
    "S_FAILED": OutcomeKind.FAILED,
    "stopped": OutcomeKind.RETRACTED,
}


def goal_outcome(mode: str, outcome: str) -> OutcomeKind:
    """Return the outcome of a goal with these slots; an ended goal without a known outcome is RETRACTED."""
    if mode in ENDED_MODES:
        return _GOAL_OUTCOMES.get(outcome, OutcomeKind.RETRACTED)
    # only a dispatched goal is executed; in the earlier modes a goal waits for the executive
    return OutcomeKind.RUNNING if mode == "DISPATCHED" else OutcomeKind.FORMULATED


def action_outcome(state: str) -> OutcomeKind:
    """Return the outcome of a plan-action; an action that waits for its effects counts as running."""
    return _ACTION_OUTCOMES.get(state, OutcomeKind.RUNNING)


def skill_outcome(status: str) -> OutcomeKind:
    """Return the outcome of a skill call with this status of its Skiller; FORMULATED for other statuses."""
    return _SKILL_OUTCOMES.get(status, OutcomeKind.FORMULATED)


def outcomes_as_json() -> dict[str, Any]:
    """Return the outcomes and their states for pages, as JSON values."""
    states = {"goal": _GOAL_OUTCOMES, "action": _ACTION_OUTCOMES, "skill": _SKILL_OUTCOMES}
    return {
        "kinds": {
            kind.name.lower(): {"word": kind.word, "icon": kind.icon, "tone": kind.tone}
            for kind in OutcomeKind
        },
        "ended": ENDED_MODES,
        **{
            subject: {state: kind.name.lower() for state, kind in table.items()}
            for subject, table in states.items()
        },
    }
