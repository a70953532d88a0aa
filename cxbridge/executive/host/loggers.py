"""The loggers of an environment, called by priority like CLIPS' routers.

Each environment starts with the logger ``log``, which writes all lines to the log. Clients may add loggers
with a higher or lower priority. A replacing logger hides its lines from the loggers below it;
other loggers pass their lines on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from cxbridge.errors import ClipsError
from cxbridge.events import Level

LineSink = Callable[[Level, str], None]
"""Gets the level and text of a line."""

DEFAULT_LOGGER: Final = "log"
"""The name of each environment's first logger."""

DEFAULT_PRIORITY: Final = 30
"""The priority of the first logger, as that of the router ``cxlog`` in ros2_cx."""

ADDED_LOGGER_PRIORITY: Final = 40
"""The default priority of added loggers, above the first logger."""

MAX_LOGGERS: Final = 16
"""The maximum number of loggers in an environment."""

MAX_PRIORITY: Final = 2000
"""The largest absolute value of a priority, as for routers in CLIPS."""

LEVELS: Final = tuple(Level)
"""The levels in ascending order."""


class ClipsLogger(Struct, frozen=True):
    """A receiver of an environment's lines.

    :param name: unique in the environment.
    :param sink: receives the accepted lines.
    :param priority: loggers with higher priorities are called first; among equal priorities, the latest
        logger.
    :param level: the minimum level of accepted lines.
    :param contains: a text that accepted lines contain.
    :param replaces: whether accepted lines are hidden from the loggers below.
    :param component: the component under which the lines appear in the log, shown in lists of loggers.
    """

    name: str
    sink: LineSink
    priority: int = ADDED_LOGGER_PRIORITY
    level: Level = Level.DEBUG
    contains: str = ""
    replaces: bool = False
    component: str = ""

    def accepts(self, level: Level, line: str) -> bool:
        """Return whether the logger accepts a line."""
        # the comparison with DEBUG saves the search of the levels for most lines
        if self.level is not Level.DEBUG and LEVELS.index(level) < LEVELS.index(self.level):
            return False
        return self.contains in line


class LoggerStack:
    """The loggers of an environment."""

    def __init__(self, sink: LineSink, component: str = "") -> None:
        # a new tuple for each change: rules may log in one thread while a client adds a logger in another
        self.loggers: tuple[ClipsLogger, ...] = (
            ClipsLogger(DEFAULT_LOGGER, sink, DEFAULT_PRIORITY, component=component),
        )
        """The loggers in calling order."""

    def log(self, level: Level, line: str) -> None:
        """Pass a line to the loggers that accept it, down to the first that replaces the loggers below."""
        for logger in self.loggers:
            if logger.accepts(level, line):
                logger.sink(level, line)
                if logger.replaces:
                    return

    def add(self, logger: ClipsLogger) -> None:
        """Insert a logger by priority.

        :raises ClipsError: if the name exists, there are too many loggers or the priority is out of bounds.
        """
        if any(existing.name == logger.name for existing in self.loggers):
            raise ClipsError(f"a logger '{logger.name}' already exists")
        if len(self.loggers) >= MAX_LOGGERS:
            raise ClipsError(f"an environment cannot have more than {MAX_LOGGERS} loggers")
        if abs(logger.priority) > MAX_PRIORITY:
            raise ClipsError(
                f"a logger cannot have the priority {logger.priority}",
                hint=f"use {-MAX_PRIORITY} to {MAX_PRIORITY}; the first logger has {DEFAULT_PRIORITY}",
            )
        # a stable sort: among equal priorities, the latest logger is called first
        self.loggers = tuple(sorted((logger, *self.loggers), key=lambda item: -item.priority))

    def remove(self, name: str) -> None:
        """Remove a logger.

        :raises ClipsError: if the logger is unknown, or is the first logger of the environment.
        """
        self._find_logger(name)
        if name == DEFAULT_LOGGER:
            raise ClipsError(
                f"the logger '{name}' cannot be removed", hint="add one above it that replaces it"
            )
        self.loggers = tuple(logger for logger in self.loggers if logger.name != name)

    def set_level(self, name: str, level: Level) -> None:
        """Set the minimum level of a logger.

        :raises ClipsError: if the logger is unknown.
        """
        logger_to_change = self._find_logger(name)
        self.loggers = tuple(
            replace(logger, level=level) if logger is logger_to_change else logger for logger in self.loggers
        )

    def level_of(self, name: str) -> Level:
        """Return the minimum level of a logger.

        :raises ClipsError: if the logger is unknown.
        """
        return self._find_logger(name).level

    def _find_logger(self, name: str) -> ClipsLogger:
        for logger in self.loggers:
            if logger.name == name:
                return logger
        names = ", ".join(logger.name for logger in self.loggers)
        raise ClipsError(f"there is no logger '{name}'", hint=f"there are: {names}")
