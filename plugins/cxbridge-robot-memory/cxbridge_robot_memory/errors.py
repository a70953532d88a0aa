"""Errors of the robot memory."""

from __future__ import annotations

from cxbridge.errors import ExecutiveError
from cxbridge.extras import install_command


class RobotMemoryError(ExecutiveError):
    """The robot memory refused an operation, or failed to execute it."""


class QueryError(RobotMemoryError):
    """A document, query, update or name of a collection is invalid, or needs MongoDB."""


class DuplicateKeyError(RobotMemoryError):
    """A document with this ``_id``, or this value in a unique index, exists."""


class UnreachableError(RobotMemoryError):
    """The database is unreachable, perhaps temporarily."""


def mongodb_install_command() -> str:
    """Return the shell command that installs the packages for MongoDB."""
    return install_command("mongodb", "cxbridge-robot-memory")
