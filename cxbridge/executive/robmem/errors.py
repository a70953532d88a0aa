"""The errors of the robot memory."""

from __future__ import annotations

from cxbridge.errors import ExecutiveError


class RobotMemoryError(ExecutiveError):
    """The robot memory refuses an operation, or cannot do it."""


class QueryError(RobotMemoryError):
    """A query, an update or a pipeline is not written as MongoDB reads it, or asks for what is not here."""


class DuplicateKeyError(RobotMemoryError):
    """There is a document with this `_id`, or with this value of a unique index."""


class AwayError(RobotMemoryError):
    """The database cannot be reached now; it may come back."""
