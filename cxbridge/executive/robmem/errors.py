"""The errors of the robot memory."""

from __future__ import annotations

from cxbridge.errors import ExecutiveError


class RobotMemoryError(ExecutiveError):
    """The robot memory refuses an operation, or cannot do it."""


class QueryError(RobotMemoryError):
    """A query or an update is not written as MongoDB reads it, or needs a MongoDB."""


class DuplicateKeyError(RobotMemoryError):
    """There is a document with this `_id`, or with this value of a unique index."""


class AwayError(RobotMemoryError):
    """The database cannot be reached now; it may come back."""
