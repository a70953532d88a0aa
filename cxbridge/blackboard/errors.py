"""The tree of the errors of all blackboards; :mod:`cxbridge.blackboard.kit` has those of transports.

Errors that Fawkes has, too, have the texts of Fawkes.

::

    BlackBoardError
    ├── InvalidNameError         a type, an id or a uid is empty, too long or unusable
    ├── UnknownTypeError         the interface type does not exist
    ├── WriterActiveError        the interface has another writer
    ├── VersionMismatchError     the interface is open in another version of its type
    ├── NoWriterError            a message has no receiver
    ├── ForeignInstanceError     an instance belongs to another blackboard
    ├── BlackBoardGoneError      the blackboard was shut down
    ├── InstanceError
    │    ├── WriteDeniedError    write() on a reader
    │    │    └── QueueAccessError
    │    ├── EnqueueDeniedError  a writer sends messages
    │    ├── InvalidInstanceError
    │    └── TimestampError
    └── MessageError
        ├── ForeignMessageError
        ├── UnknownMessageTypeError
        ├── MessageAlreadyQueuedError
        └── QueueFullError
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance_errors import (
    EnqueueDeniedError,
    ForeignMessageError,
    InstanceError,
    InvalidInstanceError,
    MessageAlreadyQueuedError,
    MessageError,
    QueueAccessError,
    QueueFullError,
    TimestampError,
    UnknownMessageTypeError,
    WriteDeniedError,
)

__all__ = [
    "BlackBoardError",
    "BlackBoardGoneError",
    "EnqueueDeniedError",
    "ForeignInstanceError",
    "ForeignMessageError",
    "InstanceError",
    "InvalidInstanceError",
    "InvalidNameError",
    "MessageAlreadyQueuedError",
    "MessageError",
    "NoWriterError",
    "QueueAccessError",
    "QueueFullError",
    "TimestampError",
    "UnknownMessageTypeError",
    "UnknownTypeError",
    "VersionMismatchError",
    "WriteDeniedError",
    "WriterActiveError",
]


class InvalidNameError(BlackBoardError):
    """A type, an id or a uid is empty, too long or unusable."""


class UnknownTypeError(BlackBoardError):
    """The interface type has no known definition."""

    def __init__(self, interface_type: str, hint: str | None = None) -> None:
        super().__init__(f"Interface of type '{interface_type}' not found. Module file not found.", hint=hint)


class WriterActiveError(BlackBoardError):
    """The interface has another writer.

    :param owner: the owner of the other writer; empty if unknown.
    """

    def __init__(self, interface_type: str, interface_id: str, owner: str) -> None:
        super().__init__(
            f"There is already a writer on interface '{interface_id}' of type '{interface_type}'",
            hint=f"it was opened for writing by {owner}" if owner else None,
        )
        self.owner = owner


class VersionMismatchError(BlackBoardError):
    """The interface is open in another version of its type: the hashes of the definitions differ."""

    def __init__(self, uid: str, open_hash: bytes, requested_hash: bytes) -> None:
        super().__init__(
            "Interface versions do not match, need to update and recompile interfaces?",
            hint=f"{uid} is open with hash {open_hash.hex().upper()} "
            f"but was requested with hash {requested_hash.hex().upper()}",
        )
        self.open_hash = open_hash


class NoWriterError(BlackBoardError):
    """A message has no receiver, because the interface has no writer."""

    def __init__(self, uid: str) -> None:
        super().__init__(f"No writing instance for interface {uid}")


class ForeignInstanceError(BlackBoardError):
    """The instance belongs to another blackboard."""

    def __init__(self, uid: str) -> None:
        super().__init__(f"Interface {uid} was not opened on this blackboard")


class BlackBoardGoneError(BlackBoardError):
    """The blackboard was shut down."""

    def __init__(self) -> None:
        super().__init__("The blackboard was shut down, no interface can be opened any more")
