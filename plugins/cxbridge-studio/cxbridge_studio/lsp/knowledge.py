"""The result of an examination of an agent: the functions and deftemplates, and the findings of the check.

The child process sends the result to the server as JSON.
"""

from __future__ import annotations

from typing import Any, Final

from msgspec import Struct, field

UNBOUNDED: Final = 65535  # the maximum that CLIPS reports for a function with any number of arguments


class FunctionInfo(Struct, frozen=True):
    """A function of CLIPS or of a feature.

    :param minimum: the minimum number of arguments; 0, like the maximum, if CLIPS does not report the number.
    :param maximum: the maximum number of arguments.
    :param types: CLIPS' codes of the types of the arguments.
    :param feature: the feature that provides the function; empty for CLIPS itself and the host.
    :param is_python: whether the function is written in Python; only then the arguments are known.
    """

    minimum: int = 0
    maximum: int = 0
    types: str = ""
    documentation: str = ""
    feature: str = ""
    is_python: bool = False

    @property
    def argument_count_text(self) -> str:
        """The number of arguments in words, such as ``2 or more arguments``."""
        if self.maximum == UNBOUNDED:
            return f"{self.minimum} or more arguments"
        if self.minimum == self.maximum:
            return f"{self.minimum} argument{'' if self.minimum == 1 else 's'}"
        return f"{self.minimum} to {self.maximum} arguments"


class AgentKnowledge(Struct, frozen=True):
    """The result of an examination.

    :param functions: the functions by name.
    :param templates: the slot names by deftemplate.
    :param findings: the findings of ``cxbridge check``, as in its JSON output.
    :param loaded_files: the paths of the CLIPS files that the spec loads.
    :param firings: the number of firings by rule in the last recording; empty if there is none.
    :param recording: the file name of the recording; empty if there is none.
    :param reads_as_fawkes: whether the agent reads PDDL as Fawkes does.
    :param error: the reason why the examination failed; empty if it succeeded.
    """

    functions: dict[str, FunctionInfo] = field(default_factory=dict)
    templates: dict[str, list[str]] = field(default_factory=dict)
    findings: list[dict[str, Any]] = field(default_factory=list)
    loaded_files: frozenset[str] = frozenset()
    firings: dict[str, int] = field(default_factory=dict)
    recording: str = ""
    reads_as_fawkes: bool = False
    error: str = ""

    @property
    def is_complete(self) -> bool:
        """Whether the functions are known."""
        return bool(self.functions)
