"""The loggers of an environment: they get its lines by priority, as the routers of CLIPS.

Each environment begins with one, ``log``, that brings all lines into the log. Further ones come above or
below it: one that replaces keeps the lines that it takes from those below, one that accompanies lets them
pass.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from cxbridge.errors import ClipsError
from cxbridge.events import Level

LineSink = Callable[[Level, str], None]
"""Gets a line and its level."""

DEFAULT_LOGGER: Final = "log"
"""The name of the logger that every environment has."""

DEFAULT_PRIORITY: Final = 30
"""Its priority: as in the original, where it is the router ``cxlog``."""

ABOVE: Final = 40
"""The priority of another logger, unless it says otherwise: it comes before the first one."""

MOST_LOGGERS: Final = 16
"""Loggers of one environment."""

MOST_PRIORITY: Final = 2000
"""CLIPS allows this for routers."""

ORDER: Final = tuple(Level)
"""The levels, least first."""


class ClipsLogger(Struct, frozen=True):
    """Gets lines of an environment.

    :param name: unique in the environment.
    :param sink: gets the lines that it takes.
    :param priority: a logger with a greater one is asked first; among equals, the latest one.
    :param level: the least level that it takes.
    :param contains: takes only lines with this in them.
    :param replaces: messages that this entry takes do not reach the entries below it.
    :param component: under which it logs, for lists.
    """

    name: str
    sink: LineSink
    priority: int = ABOVE
    level: Level = Level.DEBUG
    contains: str = ""
    replaces: bool = False
    component: str = ""

    def takes(self, level: Level, line: str) -> bool:
        """Whether a line is for it."""
        if self.level is not Level.DEBUG and ORDER.index(level) < ORDER.index(self.level):
            return False
        return self.contains in line


class LoggerStack:
    """The loggers of an environment.

    :param sink: of the logger that every environment has.
    :param component: under which it logs.
    """

    def __init__(self, sink: LineSink, component: str = "") -> None:
        first = ClipsLogger(DEFAULT_LOGGER, sink, DEFAULT_PRIORITY, component=component)
        self._loggers: tuple[ClipsLogger, ...] = (first,)

    @property
    def loggers(self) -> tuple[ClipsLogger, ...]:
        """The loggers, in the order in which they are asked."""
        return self._loggers

    def log(self, level: Level, line: str) -> None:
        """Hand a line to its loggers, down to the first one that replaces."""
        for logger in self._loggers:
            if logger.takes(level, line):
                logger.sink(level, line)
                if logger.replaces:
                    return

    def add(self, logger: ClipsLogger) -> None:
        """Insert a logger, by its priority.

        :raises ClipsError: when there is one of that name, or there are too many, or the priority is out of
            bounds.
        """
        if any(other.name == logger.name for other in self._loggers):
            raise ClipsError(f"there is a logger '{logger.name}' already")
        if len(self._loggers) >= MOST_LOGGERS:
            raise ClipsError(f"an environment cannot have more than {MOST_LOGGERS} loggers")
        if abs(logger.priority) > MOST_PRIORITY:
            raise ClipsError(
                f"a logger cannot have the priority {logger.priority}",
                hint=f"use {-MOST_PRIORITY} to {MOST_PRIORITY}; the first logger has {DEFAULT_PRIORITY}",
            )
        # a stable sort: among equals, who came last is asked first
        self._loggers = tuple(sorted((logger, *self._loggers), key=lambda each: -each.priority))

    def remove(self, name: str) -> None:
        """Take a logger away.

        :raises ClipsError: when there is none of that name, or it is the one that every environment has.
        """
        self._find(name)
        if name == DEFAULT_LOGGER:
            raise ClipsError(
                f"the logger '{name}' cannot be removed", hint="add one above it that replaces it"
            )
        self._loggers = tuple(logger for logger in self._loggers if logger.name != name)

    def set_level(self, name: str, level: Level) -> None:
        """Let a logger take only lines of this level and above.

        :raises ClipsError: when there is none of that name.
        """
        found = self._find(name)
        self._loggers = tuple(
            replace(logger, level=level) if logger is found else logger for logger in self._loggers
        )

    def level_of(self, name: str) -> Level:
        """Return the least level that a logger takes.

        :raises ClipsError: when there is none of that name.
        """
        return self._find(name).level

    def _find(self, name: str) -> ClipsLogger:
        for logger in self._loggers:
            if logger.name == name:
                return logger
        known = ", ".join(logger.name for logger in self._loggers)
        raise ClipsError(f"there is no logger '{name}'", hint=f"there are: {known}")


def find_level(text: str) -> Level:
    """Return a level by its name.

    :raises ClipsError: when there is none of that name.
    """
    for level in Level:
        if level.name.lower() == text:
            return level
    known = ", ".join(level.name.lower() for level in Level)
    raise ClipsError(f"there is no log level '{text}'", hint=f"use one of: {known}")
