"""What only CLIPS and the features know: their functions and deftemplates; and the findings of a check."""

from __future__ import annotations

from typing import Any, Final

import msgspec
from msgspec import Struct, field

UNBOUNDED: Final = 65535


class FunctionInfo(Struct, frozen=True):
    """A function of CLIPS, or of a feature.

    :param minimum: least number of arguments; both are 0 where CLIPS does not tell.
    :param feature: the feature that has it; empty: CLIPS itself or the host.
    """

    minimum: int = 0
    maximum: int = 0
    types: str = ""
    documentation: str = ""
    feature: str = ""
    is_python: bool = False

    @property
    def arguments(self) -> str:
        """The number of its arguments, in words; empty when unknown."""
        if not self.is_python:
            return ""
        if self.maximum == UNBOUNDED:
            return f"{self.minimum} or more arguments"
        if self.minimum == self.maximum:
            return f"{self.minimum} argument{'' if self.minimum == 1 else 's'}"
        return f"{self.minimum} to {self.maximum} arguments"


class AgentKnowledge(Struct, frozen=True):
    """What an examination of the agent has found.

    :param templates: the slots of the deftemplates that CLIPS has.
    :param findings: those of ``cxbridge check``, as its JSON has them.
    :param loaded: the CLIPS files that the spec loads.
    :param firings: how often each rule fired in the last recording.
    :param recording: its name; empty when there is none.
    :param reads_as_fawkes: whether the agent reads PDDL as Fawkes does.
    :param error: why the agent could not be examined; empty when it could.
    """

    functions: dict[str, FunctionInfo] = field(default_factory=dict)
    templates: dict[str, list[str]] = field(default_factory=dict)
    findings: list[dict[str, Any]] = field(default_factory=list)
    loaded: list[str] = field(default_factory=list)
    firings: dict[str, int] = field(default_factory=dict)
    recording: str = ""
    reads_as_fawkes: bool = False
    error: str = ""

    @property
    def is_complete(self) -> bool:
        """Whether the functions are known."""
        return bool(self.functions)


NOTHING: Final = AgentKnowledge()


def decode(data: bytes) -> AgentKnowledge:
    """Return the output of an examination's process.

    :raises msgspec.DecodeError: when it is something else.
    """
    return msgspec.json.decode(data, type=AgentKnowledge)
