"""The estimator of fixed durations, and the settings that all estimators have."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

from cxbridge.errors import SkillerError
from cxbridge.skiller.simulation.deciders import FOREVER_S, Decider, Outcome
from cxbridge.skiller.skillstring import SkillStringCall

if TYPE_CHECKING:
    from cxbridge.config import Configuration

CONFIG_PREFIX = "/plugins/execution-time-estimator"
"""The path of the estimators' configuration."""

STATIC_PREFIX = f"{CONFIG_PREFIX}/static"
"""The path of the static estimator's configuration."""


@dataclass(frozen=True, slots=True)
class SkillPattern:
    """A pattern of skill calls: an entry of a whitelist or blacklist, or of the injected failures.

    :param name: the name of the skill.
    :param args: regular expressions by argument, each of which must match the whole value.
    :param seconds: the duration, for the static estimator; None: the estimator's default.
    """

    name: str
    args: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None

    def matches(self, call: SkillStringCall) -> bool:
        """Return whether a call has this skill and matching arguments."""
        return call.name == self.name and all(
            key in call.args and re.fullmatch(pattern, argument_text(call.args[key])) is not None
            for key, pattern in self.args.items()
        )


@dataclass(frozen=True)
class EstimatorSettings:
    """The settings that all estimators have.

    :param whitelist: patterns of the supported calls, of which the first match counts; empty: all calls.
    :param blacklist: patterns of calls that the estimator does not support.
    :param speed: the factor by which skills are faster: it divides their durations.
    :param priority: the priority as a decider, see :class:`Decider`.
    """

    whitelist: Sequence[SkillPattern] = ()
    blacklist: Sequence[SkillPattern] = ()
    speed: float = 1.0
    priority: int = 0

    @classmethod
    def from_config(cls, config: Configuration, prefix: str) -> Self:
        """Read ``speed``, ``priority``, ``whitelist`` and ``blacklist`` below ``prefix``.

        :raises ConfigError: if a value has another type.
        :raises SkillerError: if a speed, a duration or an argument's pattern is invalid.
        """
        speed = config.get_float(f"{prefix}/speed", default=1.0)
        if not 0 < speed < math.inf:
            raise invalid_value_error(
                config, f"{prefix}/speed", f"is {speed:g}", "a speed must be above 0 and finite"
            )
        return cls(
            whitelist=read_patterns(config, f"{prefix}/whitelist"),
            blacklist=read_patterns(config, f"{prefix}/blacklist"),
            speed=speed,
            priority=config.get_int(f"{prefix}/priority", default=0),
        )

    def find_pattern(self, call: SkillStringCall) -> SkillPattern | None:
        """Return the first matching pattern of the whitelist, or None."""
        return next((pattern for pattern in self.whitelist if pattern.matches(call)), None)

    def refuses(self, call: SkillStringCall) -> bool:
        """Return whether a pattern of the blacklist matches the call."""
        return any(pattern.matches(call) for pattern in self.blacklist)

    def allows(self, call: SkillStringCall) -> bool:
        """Return whether the lists permit the call."""
        return not self.refuses(call) and (not self.whitelist or self.find_pattern(call) is not None)


@dataclass(frozen=True)
class StaticEstimator(EstimatorSettings, Decider):
    """Takes durations from the first matching pattern of the whitelist, else the default duration.

    A call without pattern has the default duration, too: the whitelist does not exclude calls.

    :param seconds: the default duration; None: no default.
    """

    seconds: float | None = None

    @classmethod
    def from_config(cls, config: Configuration, prefix: str = STATIC_PREFIX) -> Self:
        """Read ``exec-time`` and the :class:`EstimatorSettings` below ``prefix``.

        :raises ConfigError: if a value has another type.
        :raises SkillerError: if a speed, a duration or an argument's pattern is invalid.
        """
        return replace(
            super().from_config(config, prefix), seconds=_read_seconds(config, f"{prefix}/exec-time")
        )

    def decide(self, call: SkillStringCall) -> Outcome | None:
        if self.refuses(call):
            return None
        pattern = self.find_pattern(call)
        seconds = self.seconds if pattern is None or pattern.seconds is None else pattern.seconds
        return None if seconds is None else Outcome(seconds / self.speed)


def argument_text(value: object) -> str:
    """Return an argument as in a skill string, without quotes."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def invalid_value_error(config: Configuration, path: str, fault: str, hint: str) -> SkillerError:
    """Return the error about a configured value, with its file and line.

    :param fault: the end of the message, after the path, such as ``is 2``.
    """
    value = config.get(path)
    return SkillerError(f"{path} {fault}", file=value.file or None, line=value.line or None, hint=hint)


def read_patterns(config: Configuration, path: str) -> list[SkillPattern]:
    """Read the entries below ``path`` that have a name, sorted by key.

    :raises ConfigError: if a value has another type.
    :raises SkillerError: if an argument's pattern or a duration is invalid.
    """
    # sorted, because the first match wins and users number their entries
    keys = [key for key in sorted(config.keys(path)) if config.exists(f"{path}/{key}/name")]
    return [read_pattern(config, path, key) for key in keys]


def read_pattern(config: Configuration, path: str, key: str) -> SkillPattern:
    """Read the settings ``name``, ``args`` and ``exec-time`` of the entry ``key`` below ``path``.

    :raises ConfigError: if the name is missing or a value has another type.
    :raises SkillerError: if an argument's pattern or a duration is invalid.
    """
    args_path = f"{path}/{key}/args"
    args: dict[str, str] = {}
    for arg_text in config.get_strings(args_path) if config.exists(args_path) else []:
        name, separator, value = arg_text.partition("=")
        if not separator:
            raise invalid_value_error(
                config, args_path, f"has '{arg_text}'", 'write NAME=PATTERN, e.g. ["text=hello .*"]'
            )
        args[name.strip()] = value.strip().strip("'\"")
        try:
            re.compile(args[name.strip()])
        except re.error as error:
            raise invalid_value_error(
                config,
                args_path,
                f"has the pattern '{value}': {error}",
                "write a regular expression for the whole value, e.g. hello .*",
            ) from None
    return SkillPattern(
        name=config.get_str(f"{path}/{key}/name"),
        args=args,
        seconds=_read_seconds(config, f"{path}/{key}/exec-time"),
    )


def _read_seconds(config: Configuration, path: str) -> float | None:
    if not config.exists(path):
        return None
    seconds = config.get_float(path)
    if not 0 <= seconds <= FOREVER_S:
        raise invalid_value_error(config, path, f"is {seconds:g}", f"write seconds, from 0 to {FOREVER_S:g}")
    return seconds
