"""The settings of planning, below ``/planner/`` in the configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from cxbridge.config import Configuration

DEFAULT_TIMEOUT: Final = 60.0
"""The default time limit of planning in seconds."""

DEFAULT_AT_ONCE: Final = 2
"""The default number of concurrent planner calls."""

DEFAULT_MEMORY: Final = 4 << 30
"""The default limit of a planner process' address space, in bytes."""

_MEBIBYTE: Final = 1 << 20  # the setting is in MiB


@dataclass(frozen=True, slots=True)
class PlannerSettings:
    """The configuration below ``/planner/``.

    :param planner: the name of the default planner, or ``auto``.
    :param timeout: the time limit of a call in seconds.
    :param at_once: the number of concurrent planner calls; further calls wait.
    :param memory: the limit of a planner process' address space in bytes; 0: no limit.
    :param options: the options of the default planner.
    :param check_plans: whether plans are checked against the facts before and during their execution.
    """

    planner: str = "auto"
    timeout: float = DEFAULT_TIMEOUT
    at_once: int = DEFAULT_AT_ONCE
    memory: int = DEFAULT_MEMORY
    options: dict[str, str] = field(default_factory=dict)
    check_plans: bool = True

    @classmethod
    def from_config(cls, config: Configuration) -> PlannerSettings:
        """Read the settings.

        :raises ConfigError: if a setting has the wrong type.
        """
        prefix = "/planner/options/"
        defaults = cls()
        return cls(
            config.get_str("/planner/planner", default=defaults.planner),
            config.get_float("/planner/timeout", default=defaults.timeout),
            # with 0, every call would wait for a process until its timeout
            max(1, config.get_uint("/planner/at-once", default=defaults.at_once)),
            config.get_uint("/planner/memory", default=defaults.memory // _MEBIBYTE) * _MEBIBYTE,
            {item.path[len(prefix) :]: item.text for item in config.search(prefix)},
            config.get_bool("/planner/check-plans", default=defaults.check_plans),
        )
