"""Why a skill string failed: one value, made at the place of the failure, with the texts for its readers.

The field ``error`` of SkillerInterface carries the text to the executive, whose rules take it into the slot
``error-msg`` of the skill and of the plan-action.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from cxbridge.errors import SkillError
from cxbridge.skiller.status import Status


class FailureCause(Enum):
    """What failed, with the beginning of its line in the log; an outcome has none."""

    SKILL_STRING = "Failed to compile skill string"
    CODE = "Failed to execute skill"
    OUTCOME = ""


@dataclass(frozen=True, slots=True)
class SkillFailure:
    """Why a skill string failed.

    :param cause: the skill string cannot be run, the code of a skill raised an error, or a skill ended so.
    :param text: the reason in words; may be empty.
    :param place: where the configuration maps an action to the skill string; empty when it is not known.
    """

    cause: FailureCause
    text: str = ""
    place: str = ""

    @classmethod
    def of_string(cls, error: SkillError) -> SkillFailure:
        """Return the failure of a skill string that cannot be read."""
        return cls(FailureCause.SKILL_STRING, error.message)

    def error(self, skill_string: str) -> str:
        """Return the text of the field ``error``."""
        return f"{skill_string}|{self.text}" if self.cause is FailureCause.CODE else self.text

    def line(self, skill_string: str) -> str:
        """Return the line of the log."""
        mapped = f" (mapped at {self.place})" if self.place else ""
        if self.cause is FailureCause.CODE:
            return f"{self.cause.value}{mapped}: {skill_string}|{self.text}"
        return f"{self.cause.value}: {skill_string}|{self.text}{mapped}"

    def show(self, interface: Any) -> None:
        """Set status and error of a SkillerInterface that its Skiller writes."""
        interface.status = Status.S_FAILED
        interface.error = self.error(interface.skill_string)
