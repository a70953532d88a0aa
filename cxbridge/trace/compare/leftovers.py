"""What a skiller still says of a run before: how its last skill ended, until it runs one for this run."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from cxbridge.events import SkillStatus

_ENDED: Final = ("S_FINAL", "S_FAILED")
_IDLE: Final = "S_INACTIVE"


class Leftovers:
    """Shows the states of skillers as if none had worked before the run.

    A skiller that was used says at first how the skill of somebody else ended, also after control is
    acquired, until it runs a skill. That is taken for the idle state of a fresh one; said again, for nothing.
    """

    def __init__(self) -> None:
        self._left: dict[
            tuple[str, str], str
        ] = {}  # the skill that was left over; empty when the run has begun

    def fresh(self, event: SkillStatus) -> SkillStatus | None:
        """Return a state as a fresh skiller would have told it; None: it would not have."""
        skiller = (event.env, event.skiller)
        left = self._left.get(skiller)
        ended = event.status in _ENDED and event.skill_string
        if left is None and ended:
            self._left[skiller] = event.skill_string
            return replace(event, skill_string="", msgid=0, status=_IDLE)
        if left and ended and event.skill_string == left:
            return None
        self._left[skiller] = ""
        return event
