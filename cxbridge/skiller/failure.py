"""The reason of a failed skill string, with its texts for log and interface.

SkillerInterface's field ``error`` carries the text to the executive, whose rules copy it to the slot
``error-msg`` of skill and plan-action.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from cxbridge.errors import SkillError
from cxbridge.skiller.status import Status


class FailureCause(Enum):
    """The kind of a failure, with the prefix of its log line."""

    SKILL_STRING = "Failed to compile skill string"
    CODE = "Failed to execute skill"
    OUTCOME = ""


@dataclass(frozen=True, slots=True)
class SkillFailure:
    """A failed skill string.

    :param cause: an invalid skill string, an error in a skill's code, or the outcome of a skill.
    :param text: the reason; may be empty.
    :param place: the place of the action mapping; empty if unknown.
    """

    cause: FailureCause
    text: str = ""
    place: str = ""

    @classmethod
    def of_string(cls, error: SkillError) -> SkillFailure:
        """Return the failure of an invalid skill string."""
        return cls(FailureCause.SKILL_STRING, error.message)

    def error(self, skill_string: str) -> str:
        """Return the text of the field ``error``."""
        return f"{skill_string}|{self.text}" if self.cause is FailureCause.CODE else self.text

    def line(self, skill_string: str) -> str:
        """Return the log line."""
        mapped = f" (mapped at {self.place})" if self.place else ""
        if self.cause is FailureCause.CODE:
            return f"{self.cause.value}{mapped}: {skill_string}|{self.text}"
        return f"{self.cause.value}: {skill_string}|{self.text}{mapped}"

    def show(self, interface: Any) -> None:
        """Set status and error of a SkillerInterface."""
        interface.status = Status.S_FAILED
        interface.error = self.error(interface.skill_string)
