"""Terms of the skill board's protocol: tickets, states, skill calls, and their encoding.

A master finds an executor for one action and follows the action to its end. docs/skill-board.md describes the
protocol.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeVar

from cxbridge.errors import SkillError

BOARD_TYPE: Final = "SkillBoardInterface"
EXECUTOR_TYPE: Final = "SkillExecutorInterface"
DEFAULT_BOARD: Final = "SkillBoard"
"""The default id of the SkillBoardInterface."""

# the limits are the lengths of the text fields in interfaces/Skill*.xml without the final NUL
MAX_NAME_BYTES: Final = 64
"""The maximum length in bytes of the name of an agent, skill, executor or board."""

MAX_LABEL_BYTES: Final = 128
"""The maximum length in bytes of a master's label."""

MAX_PARAMETERS_BYTES: Final = 1023
"""The maximum length in bytes of the parameters as JSON."""

MAX_SKILLS_BYTES: Final = 1023
"""The maximum length in bytes of an executor's list of skills."""

Default = TypeVar("Default")
REQUIRED: Final[Any] = object()
"""The default of a parameter or setting that must not be missing."""

_ENCODER: Final = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":"))


class Ticket(NamedTuple):
    """The addressee of a message: a master of one epoch of a board.

    :param board: the id of the SkillBoardInterface.
    :param epoch: the epoch, which changes when the board restarts.
    :param master: the number of the master, from 1.
    """

    board: str
    epoch: int
    master: int


class MasterState(StrEnum):
    """States of a master."""

    ASKING = "ASKING"
    CONFIRMED = "CONFIRMED"
    RUNNING = "RUNNING"
    CANCELLING = "CANCELLING"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"

    @property
    def is_over(self) -> bool:
        """Whether the state is final."""
        return self in _FINAL_STATES


_FINAL_STATES = frozenset({MasterState.SUCCEEDED, MasterState.FAILED, MasterState.CANCELLED})


class ExecutorState(StrEnum):
    """States of an executor."""

    IDLE = "IDLE"
    RESERVED = "RESERVED"
    BUSY = "BUSY"


class SkillOutcome(StrEnum):
    """Outcomes of an execution."""

    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"
    REFUSED = "REFUSED"


@dataclass(frozen=True, slots=True)
class SkillCall:
    """A requested skill.

    :param parameters: values by name: texts, numbers, booleans, None, lists and mappings of these. Parameters
        without name are called ``"1"``, ``"2"`` ...
    :param label: the display name of the master, truncated to :data:`MAX_LABEL_BYTES`.
    """

    skill: str
    agent: str
    parameters: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    label: str = ""

    def get(self, name: str, default: Default = REQUIRED) -> Any | Default:
        """Return a parameter.

        :raises SkillError: if the parameter is missing and there is no default.
        """
        value = self.parameters.get(name, default)
        if value is REQUIRED:
            raise SkillError(f"{self.skill} needs the parameter '{name}'")
        return value

    def text(self, name: str, default: str = REQUIRED) -> str:
        """Return a text parameter.

        :raises SkillError: if the parameter is missing without default, or not a text.
        """
        value = self.get(name, default)
        if not isinstance(value, str):
            raise SkillError(f"{self.skill}: the parameter '{name}' must be a string, not {value!r}")
        return value

    def number(self, name: str, default: float = REQUIRED) -> float:
        """Return a numeric parameter.

        :raises SkillError: if the parameter is missing without default, or not a finite number.
        """
        value = self.get(name, default)
        # math.isfinite() raises an error for an integer beyond the floats, which JSON may contain
        if isinstance(value, bool) or not (
            isinstance(value, (int, float)) and abs(value) <= sys.float_info.max
        ):
            raise SkillError(f"{self.skill}: the parameter '{name}' must be a number, not {value!r}")
        return value


def check_name(kind: str, name: str) -> str:
    """Check that a name fits into messages, and return the name.

    :param kind: the named thing with its article, for the error.
    :raises SkillError: if the name is empty, too long, contains NUL, or cannot be encoded in UTF-8.
    """
    try:
        byte_count = len(name.encode())
    except UnicodeEncodeError:
        byte_count = 0
    if not 0 < byte_count <= MAX_NAME_BYTES or "\0" in name:
        raise SkillError(
            f"{kind} cannot be called {name!r}",
            hint=f"a name must have 1 to {MAX_NAME_BYTES} bytes of UTF-8 and no NUL",
        )
    return name


def truncate(text: str, max_bytes: int) -> str:
    """Return the longest prefix of a text that fits into ``max_bytes`` bytes of UTF-8.

    The prefix has no NUL, and a question mark for each character that UTF-8 cannot encode.
    """
    return text.replace("\0", "").encode("utf-8", "replace")[:max_bytes].decode("utf-8", "ignore")


def encode_parameters(parameters: Mapping[str, Any]) -> str:
    """Return parameters as a JSON object.

    :raises SkillError: if a value has no JSON equivalent, or the text is too long.
    """
    try:
        text = _ENCODER.encode(dict(parameters))
        byte_count = len(text.encode())
    except (TypeError, ValueError, RecursionError) as error:
        raise SkillError(f"the parameters cannot be sent over the skill board: {error}") from None
    if byte_count > MAX_PARAMETERS_BYTES:
        raise SkillError(
            f"the parameters have {byte_count} bytes,"
            f" but the limit of the skill board is {MAX_PARAMETERS_BYTES}"
        )
    return text


def decode_parameters(text: str) -> dict[str, Any]:
    """Return the parameters of a message, given as JSON; an empty text means no parameters.

    :raises SkillError: if the text is not a JSON object.
    """
    try:
        parameters = json.loads(text) if text else {}
    except (ValueError, RecursionError) as error:
        raise SkillError(f"the parameters are not JSON: {error}") from None
    if not isinstance(parameters, dict):
        raise SkillError("the parameters are not a JSON object")
    return parameters


def enum_name(value: object) -> str:
    """Return the name of an enum value, or the number of an unknown value."""
    return value._name_ if isinstance(value, Enum) else str(value)  # .name would take five times as long


def limit_fraction(fraction: float) -> float:
    """Return the nearest fraction from 0 to 1; 0 for NaN."""
    return min(max(fraction, 0.0), 1.0) if fraction == fraction else 0.0  # noqa: PLR0124 - only NaN differs from itself


def replace_surrogates(text: str) -> str:
    """Return a text without characters that UTF-8 cannot encode, so that an error text always arrives."""
    # str(), because executors may yield any object as text
    return str(text).encode("utf-8", "replace").decode()
