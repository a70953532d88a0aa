"""A reason in a story, with the deeper reasons for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

# The kinds of root causes: a rule that a goal waits for, and the more certain causes, such as a precondition.
RULE_ROOT: Final = 1
CERTAIN_ROOT: Final = 2


@dataclass(frozen=True, slots=True)
class Cause:
    """A reason, with the deeper reasons for it.

    :param because: the deeper reasons, the most certain first.
    :param root: :data:`CERTAIN_ROOT` or :data:`RULE_ROOT` for a root cause, the place to change; else 0.
    """

    text: str
    because: tuple[Cause, ...] = ()
    root: int = 0

    @property
    def certainty(self) -> int:
        """The highest :attr:`root` of the cause and its deeper causes."""
        return max([self.root, *(cause.certainty for cause in self.because)])
