"""The words of the skill board's protocol: tickets, states, skill calls and their form on the blackboard.

The protocol itself is in docs/skill-board.md.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeVar

from cxbridge.errors import SkillError

BOARD_TYPE: Final = "SkillBoardInterface"
EXECUTOR_TYPE: Final = "SkillExecutorInterface"
DEFAULT_BOARD: Final = "SkillBoard"
"""Id of the SkillBoardInterface unless there are several."""

NAME_BYTES: Final = 64
"""Bytes that the name of an agent, a skill, an executor or a board may have."""

LABEL_BYTES: Final = 128
"""Bytes that a master's name may have."""

PARAMETER_BYTES: Final = 1023
SKILLS_BYTES: Final = 1023

D = TypeVar("D")
_NOT_GIVEN: Final[Any] = object()
_ENCODER: Final = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":"))


class Ticket(NamedTuple):
    """What every message names: a master, in one life of one board.

    :param board: id of the SkillBoardInterface.
    :param epoch: which of its lives.
    :param master: number of the master, from 1.
    """

    board: str
    epoch: int
    master: int


class MasterState(StrEnum):
    """Where a master is in its life."""

    ASKING = "ASKING"
    CONFIRMED = "CONFIRMED"
    RUNNING = "RUNNING"
    CANCELLING = "CANCELLING"
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"

    @property
    def is_over(self) -> bool:
        """Whether nothing comes after it."""
        return self in _OVER


_OVER = frozenset({MasterState.SUCCEEDED, MasterState.FAILED, MasterState.CANCELLED})


class ExecutorState(StrEnum):
    """Whether an executor is free."""

    IDLE = "IDLE"
    RESERVED = "RESERVED"
    BUSY = "BUSY"


class SkillOutcome(StrEnum):
    """How an execution ended."""

    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"
    REFUSED = "REFUSED"


@dataclass(frozen=True, slots=True)
class SkillCall:
    """A skill that an agent has to execute.

    :param parameters: values by name: texts, numbers, truth values, None, lists and mappings of these;
        parameters without a name are called ``"1"``, ``"2"`` ...
    :param name: the name of the requesting master, for people; cut after 128 bytes.
    """

    skill: str
    agent: str
    parameters: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    name: str = ""

    def get(self, name: str, default: D = _NOT_GIVEN) -> Any | D:
        """Return a parameter.

        :raises SkillError: when it is not given, and there is no default.
        """
        value = self.parameters.get(name, default)
        if value is _NOT_GIVEN:
            raise SkillError(f"{self.skill} needs the parameter '{name}'")
        return value

    def text(self, name: str, default: str = _NOT_GIVEN) -> str:
        """Return a parameter as text.

        :raises SkillError: when it is not given and there is no default, or it is something else.
        """
        value = self.get(name, default)
        if not isinstance(value, str):
            raise SkillError(f"{self.skill} needs a text as '{name}', not {value!r}")
        return value

    def number(self, name: str, default: float = _NOT_GIVEN) -> float:
        """Return a parameter as a number.

        :raises SkillError: when it is not given and there is no default, or it is not a finite number.
        """
        value = self.get(name, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise SkillError(f"{self.skill} needs a number as '{name}', not {value!r}")
        return value


def check_name(kind: str, name: str) -> str:
    """Return a name that fits into the messages.

    :raises SkillError: when it is empty, too long, or has a NUL or no UTF-8 form.
    """
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        size = 0
    if not 0 < size <= NAME_BYTES or "\0" in name:
        raise SkillError(
            f"{kind} cannot be called {name!r}", hint=f"a name has 1 to {NAME_BYTES} bytes of UTF-8, no NUL"
        )
    return name


def cut(text: str, size: int) -> str:
    """Return the part of a text that has a UTF-8 form of at most this many bytes, without NUL."""
    return text.replace("\0", "").encode("utf-8", "replace")[:size].decode("utf-8", "ignore")


def encode_parameters(parameters: Mapping[str, Any]) -> str:
    """Return parameters as they go over the board: a JSON object.

    :raises SkillError: when a value has no form in JSON, or it is too long.
    """
    try:
        text = _ENCODER.encode(dict(parameters))
        size = len(text.encode())
    except (TypeError, ValueError, RecursionError) as error:
        raise SkillError(f"the parameters cannot go over the skill board: {error}") from None
    if size > PARAMETER_BYTES:
        raise SkillError(f"the parameters have {size} bytes, the skill board takes {PARAMETER_BYTES}")
    return text


def decode_parameters(text: str) -> dict[str, Any]:
    """Return the parameters of a message.

    :raises SkillError: when the text is not a JSON object.
    """
    try:
        value = json.loads(text) if text else {}
    except (ValueError, RecursionError) as error:
        raise SkillError(f"the parameters are not JSON: {error}") from None
    if not isinstance(value, dict):
        raise SkillError("the parameters are not a JSON object")
    return value


def name_of(value: object) -> str:
    """Return the name of an enum value of a block, or the number itself if it has no name."""
    return value._name_ if isinstance(value, Enum) else str(value)  # .name takes five times as long


def share(fraction: float) -> float:
    """Return a fraction from 0 to 1, whatever a skill has said."""
    return min(max(fraction, 0.0), 1.0) if fraction == fraction else 0.0  # noqa: PLR0124 - NaN


def sayable(text: str) -> str:
    """Return a text without characters that have no UTF-8 form; an error must get through in any case."""
    return str(text).encode("utf-8", "replace").decode()
