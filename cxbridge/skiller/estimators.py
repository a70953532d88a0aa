"""How long skills take when they are only simulated."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from cxbridge.errors import SkillerError
from cxbridge.skiller.skillstring import SkillCall
from cxbridge.skiller.status import Status

STATIC_PREFIX = "/plugins/execution-time-estimator/static"
"""Where the configuration of the static estimator is."""


class EstimatorConfig(Protocol):
    """The part of :class:`cxbridge.config.Configuration` that estimators read."""

    def exists(self, path: str) -> bool:
        """Whether there is a value at ``path``."""

    def keys(self, path: str) -> list[str]:
        """Return the names below ``path``, none when there is nothing."""

    def get_str(self, path: str) -> str:
        """Return the text at ``path``."""

    def get_int(self, path: str) -> int:
        """Return the integer at ``path``."""

    def get_float(self, path: str) -> float:
        """Return the number at ``path``."""

    def get_strings(self, path: str) -> list[str]:
        """Return the texts at ``path``."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a simulated skill ends.

    :param seconds: how long it takes.
    """

    seconds: float
    status: Status = Status.S_FINAL
    error: str = ""


class Estimator(ABC):
    """Knows how skills end.

    :param priority: the one with the highest is asked first.
    """

    priority: int = 0

    @abstractmethod
    def estimate(self, call: SkillCall) -> Outcome | None:
        """Return how the skill ends; None when this estimator cannot tell."""


@dataclass(frozen=True, slots=True)
class SkillPattern:
    """An entry of a white or black list.

    :param name: the skill.
    :param args: regular expressions that the values of these arguments match as a whole.
    """

    name: str
    args: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None

    def matches(self, call: SkillCall) -> bool:
        """Whether the call is one of those."""
        return call.name == self.name and all(
            key in call.args and re.fullmatch(pattern, _as_text(call.args[key]))
            for key, pattern in self.args.items()
        )


@dataclass(frozen=True, slots=True)
class StaticEstimator(Estimator):
    """Durations from the configuration.

    :param whitelist: skills that it answers for, the first that matches gives the duration; empty: all.
    :param blacklist: skills that it does not answer for.
    :param seconds: the duration of entries that have none; None: there is no default.
    :param speed: durations are divided by it.
    """

    whitelist: Sequence[SkillPattern] = ()
    blacklist: Sequence[SkillPattern] = ()
    seconds: float | None = None
    speed: float = 1.0
    priority: int = 0

    @classmethod
    def from_config(cls, config: EstimatorConfig, prefix: str = STATIC_PREFIX) -> StaticEstimator:
        """Read ``exec-time``, ``speed``, ``priority``, ``whitelist`` and ``blacklist`` below ``prefix``.

        :raises SkillerError: when the speed is not above zero.
        """

        def number(path: str) -> float | None:
            return config.get_float(path) if config.exists(path) else None

        speed = number(f"{prefix}/speed")
        if speed is not None and not speed > 0:
            raise SkillerError(f"{prefix}/speed is {speed:g}", hint="a speed must be above 0")
        has_priority = config.exists(f"{prefix}/priority")
        return cls(
            whitelist=_read_list(config, f"{prefix}/whitelist"),
            blacklist=_read_list(config, f"{prefix}/blacklist"),
            seconds=number(f"{prefix}/exec-time"),
            speed=speed or 1.0,
            priority=config.get_int(f"{prefix}/priority") if has_priority else 0,
        )

    def estimate(self, call: SkillCall) -> Outcome | None:
        """Return the duration of the first entry that matches, the default otherwise."""
        if any(entry.matches(call) for entry in self.blacklist):
            return None
        entry = next((entry for entry in self.whitelist if entry.matches(call)), None)
        seconds = entry.seconds if entry is not None and entry.seconds is not None else self.seconds
        return None if seconds is None else Outcome(seconds / self.speed)


def _as_text(value: object) -> str:
    """Return an argument as it stands in a skill string, without quotes."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _read_list(config: EstimatorConfig, path: str) -> list[SkillPattern]:
    entries = []
    for key in sorted(config.keys(path)):
        if not config.exists(f"{path}/{key}/name"):
            continue
        texts = config.get_strings(f"{path}/{key}/args") if config.exists(f"{path}/{key}/args") else []
        args = dict(text.split("=", 1) for text in texts if "=" in text)
        has_time = config.exists(f"{path}/{key}/exec-time")
        entries.append(
            SkillPattern(
                name=config.get_str(f"{path}/{key}/name"),
                args={name.strip(): value.strip().strip("'\"") for name, value in args.items()},
                seconds=config.get_float(f"{path}/{key}/exec-time") if has_time else None,
            )
        )
    return entries
